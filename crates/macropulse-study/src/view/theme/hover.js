// Values of a chart at the pointer, or, with the chart in focus, by the arrow keys.
//
// A chart tells its points in an element `metadata`: { x, y: titles, box: [left, top, right, bottom],
// series: [{ name, hue, points: [[place x, place y, text x, text y], …] }, …] }.

(() => {
  const SVG = "http://www.w3.org/2000/svg";
  const note = document.createElement("div");
  note.className = "at-pointer";
  note.setAttribute("role", "status");
  note.hidden = true;
  document.body.append(note);

  const made = (name, attributes, parent) => {
    const one = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) one.setAttribute(key, value);
    parent.append(one);
    return one;
  };

  for (const told of document.querySelectorAll("svg.mp metadata")) {
    const plane = told.parentNode;
    const drawing = plane.closest("svg.mp");
    const { x, y, box, series } = JSON.parse(told.textContent);
    const all = series.flatMap(({ points }) => points);
    if (all.length === 0) continue;
    const places = [...new Set(all.map(([at]) => at))].sort((a, b) => a - b);
    let marks = null;
    let current = -1;

    const clear = () => {
      marks?.remove();
      marks = null;
      note.hidden = true;
    };

    // Shows what lies at the place `at`, and the note beside it.
    const show = (at) => {
      clear();
      marks = made("g", { "pointer-events": "none" }, plane);
      made("line", { class: "axis", x1: at, x2: at, y1: box[1], y2: box[3] }, marks);
      const lines = [];
      let title = "";
      for (const { name, hue, points } of series) {
        for (const [px, py, textX, textY] of points.filter(([place]) => Math.abs(place - at) < 0.75).slice(0, 4)) {
          made("circle", { class: `outline ${hue}`, cx: px, cy: py, r: 4 }, marks);
          title = textX;
          lines.push([hue, name || y, textY]);
        }
      }
      note.replaceChildren();
      const head = document.createElement("p");
      head.textContent = `${x}: ${title}`;
      note.append(head);
      for (const [hue, name, text] of lines) {
        const line = document.createElement("p");
        const swatch = document.createElement("i");
        swatch.className = hue;
        line.append(swatch, `${name}: ${text}`);
        note.append(line);
      }
      note.hidden = false;
      const spot = new DOMPoint(at, box[1]).matrixTransform(plane.getScreenCTM());
      const right = spot.x + 14 + note.offsetWidth < document.documentElement.clientWidth;
      note.style.left = `${Math.max(4, right ? spot.x + 14 : spot.x - 14 - note.offsetWidth)}px`;
      note.style.top = `${Math.max(4, spot.y)}px`;
    };

    const follow = (event) => {
      const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(plane.getScreenCTM().inverse());
      const inside = at.x > box[0] - 12 && at.x < box[2] + 12 && at.y > box[1] - 12 && at.y < box[3] + 12;
      if (!inside) return clear();
      let nearest = all[0];
      const off = ([px, py]) => Math.abs(px - at.x) + 0.15 * Math.abs(py - at.y);
      for (const point of all) if (off(point) < off(nearest)) nearest = point;
      current = places.indexOf(nearest[0]);
      show(nearest[0]);
    };

    drawing.addEventListener("pointermove", follow);
    drawing.addEventListener("pointerdown", follow);
    drawing.addEventListener("pointerleave", clear);
    drawing.setAttribute("tabindex", "0");
    drawing.addEventListener("blur", clear);
    drawing.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1, Home: -Infinity, End: Infinity }[event.key];
      if (event.key === "Escape") clear();
      if (!step) return;
      event.preventDefault();
      current = Math.min(Math.max(current + step, 0), places.length - 1);
      show(places[current]);
    });
  }
})();
