// What is told in words and numbers: the point that is picked, the legend.

const FLAGS = [[1, "faint"], [2, "ambiguous"], [4, "saturated"]];

// Attributes of a point as pairs of name and text.
function attributesOf(cloud, at, outcomes) {
  const named = {
    outcome: (code) => outcomes.find((one) => one.code === code)?.name,
    object: (number) => cloud.objects[number],
    material: (number) => cloud.materials[number],
    flags: (bits) =>
      FLAGS.filter(([bit]) => bits & bit).map(([, name]) => name).join(", ") || "none",
  };
  return Object.entries(cloud.values)
    .filter(([name]) => name !== "shown")
    .map(([name, values]) => {
      const value = values[at];
      if (Number.isNaN(value)) return [name, "none"];
      const text = named[name]?.(value) ?? value.toFixed(digitsOf(cloud.steps[name]));
      if (name === "intensity" && isBound(cloud, at)) return [name, `${text} or more`];
      const unit = cloud.units[name];
      return [name.replace("_ns", "").replaceAll("_", " "), unit ? `${text} ${unit}` : text];
    });
}

// Whether the detector is saturated: then it tells of the energy that it was as much at least. One that
// never misses has no scale for it, and says 1.
function isBound(cloud, at) {
  const { intensity, flags } = cloud.values;
  return (flags?.[at] & 4) !== 0 && intensity?.[at] !== 1;
}

// Decimals that values of this step have.
function digitsOf(step) {
  return Math.max(0, Math.round(-Math.log10(step)));
}

// Writes pairs into a list of terms.
function tell(list, pairs) {
  list.replaceChildren(
    ...pairs.map(([name, text]) => {
      const line = document.createElement("div");
      const [term, told] = [document.createElement("dt"), document.createElement("dd")];
      term.textContent = name;
      told.textContent = text;
      line.dataset.name = name;
      line.append(term, told);
      return line;
    }),
  );
}

// Fills the legend of a scale. `toggled` is called with a class whose points are to be shown or
// hidden.
function showLegend(legend, scale, hidden, toggled) {
  legend.replaceChildren();
  if (scale.classes) {
    for (const one of scale.classes.filter(({ count }) => count > 0)) {
      const button = document.createElement("button");
      const swatch = document.createElement("i");
      swatch.style.background = `rgb(${one.colour})`;
      button.type = "button";
      button.className = "class";
      button.setAttribute("aria-pressed", String(!hidden.has(one.code)));
      button.title = "Show or hide";
      button.append(swatch, `${one.name} `, Object.assign(document.createElement("small"), {
        textContent: grouped(one.count),
      }));
      button.addEventListener("click", () => toggled(one.code));
      legend.append(button);
    }
    return;
  }
  const bar = document.createElement("canvas");
  [bar.width, bar.height, bar.id] = [255, 1, "ramp"];
  const pen = bar.getContext("2d");
  const picture = pen.createImageData(255, 1);
  picture.data.set(scale.table.subarray(4));
  pen.putImageData(picture, 0, 0);
  const ends = document.createElement("div");
  const span = scale.high - scale.low;
  const digits = span > 0 ? Math.max(0, 2 - Math.floor(Math.log10(span))) : 2;
  const label = (value) => `${value.toFixed(Math.min(digits, 4))}${scale.unit ? ` ${scale.unit}` : ""}`;
  ends.className = "ends";
  for (const share of [0, 0.5, 1]) {
    const end = document.createElement("span");
    end.textContent = label(scale.low + share * span);
    ends.append(end);
  }
  const note = document.createElement("small");
  note.textContent = scale.isCut
    ? "From the 1st to the 99th percentile; what lies beyond has the colour of the end."
    : "From the lowest to the highest value.";
  legend.append(bar, ends, note);
}

// 1234567 as 1 234 567, with blanks that keep it on its line.
function grouped(number) {
  return String(number).replace(/\B(?=(\d{3})+$)/g, "\u202f");
}
