// The page: which cloud, in which colours, from where, and what is picked.

const element = (id) => document.getElementById(id);
const embedded = (id) => JSON.parse(element(id).textContent);

const about = embedded("about");
const outcomes = about.outcomes.map((outcome, code) => ({ ...outcome, code }));
for (const one of document.querySelectorAll(".scans")) one.hidden = element("scan").options.length < 2;

const camera = new Camera();
const overlay = new Overlay(element("overlay"));
const image = new RangeImage(element("image"), element("image-mark"));
const state = { cloud: null, scale: null, hidden: new Set(), picked: null, isMoving: false };
let points = null;
try {
  points = new Points(element("cloud"));
} catch (failure) {
  say(`The cloud cannot be shown: ${failure.message}. The range image and the files can.`);
}

function say(sentence) {
  element("said").textContent = sentence;
  element("said").hidden = !sentence;
}

// --- The cloud

async function open(at) {
  const packed = embedded(`scan-${at}`);
  if (typeof DecompressionStream === "undefined") {
    say("This browser cannot unpack the points: it is older than 2023. The files can be opened.");
    return;
  }
  const cloud = await cloudOf(packed);
  const isFirst = state.cloud === null;
  Object.assign(state, { cloud, picked: null });
  document.body.dataset.scan = String(at);
  const { x, y, z } = cloud.values;
  const [xs, ys, zs] = [x, y, z].map((values) => percentiles(values ?? [NaN], [0.01, 0.5, 0.99]));
  // Places far from the origin are told from a point near them, which single precision can.
  cloud.origin = [xs, ys, zs].map(([, middle]) => (Math.abs(middle) > 1e4 ? Math.round(middle) : 0));
  cloud.bounds = [xs, ys, zs].map(([low, , high], i) => [low - cloud.origin[i], high - cloud.origin[i]]);
  cloud.ground = cloud.bounds[2][0];
  cloud.reach = Math.max(...cloud.bounds.slice(0, 2).flat().map(Math.abs), 1);
  cloud.far = Math.hypot(...[x, y, z].map((values, i) =>
    values?.reduce((far, value) => Math.max(far, Math.abs(value - cloud.origin[i])), 0) ?? 0));
  if (points) {
    const places = new Float32Array(3 * cloud.points);
    for (let i = 0; i < cloud.points; i += 1) {
      places[3 * i] = x[i] - cloud.origin[0];
      places[3 * i + 1] = y[i] - cloud.origin[1];
      places[3 * i + 2] = z[i] - cloud.origin[2];
    }
    points.load(places);
  }
  element("image-part").hidden = cloud.image.length === 0;
  const thinned = cloud.points < cloud.of ? `, every ${Math.round(cloud.of / cloud.points)}th of ${grouped(cloud.of)}` : "";
  element("count").textContent = `${grouped(cloud.points)} points${thinned}`;
  if (cloud.points === 0) say("No point in this cloud: the sensor had no return. See the facts of the run.");
  offerColours();
  if (isFirst) {
    element("size").value = [[2e5, 2], [2e4, 3], [0, 4.5]].find(([least]) => cloud.points >= least)[1];
    look("all");
  }
  pick(null);
}

function offerColours() {
  const { cloud } = state;
  const offered = colourings(cloud, outcomes);
  const select = element("colour");
  const before = select.value || "range";
  select.replaceChildren(...offered.map(({ column, title }) => new Option(title, column)));
  select.value = offered.some(({ column }) => column === before) ? before : offered[0]?.column;
  recolour();
}

function recolour() {
  const { cloud, hidden } = state;
  const colouring = colourings(cloud, outcomes).find(({ column }) => column === element("colour").value);
  if (!colouring) return;
  const scale = scaleOf(cloud, colouring, theme.isDark());
  if (scale.classes) {
    const counts = new Array(256).fill(0);
    for (const shade of scale.shades) counts[shade] += 1;
    if (scale.column === "outcome") {
      cloud.outcomes?.forEach((code, pixel) => (cloud.image[pixel] < 0 ? (counts[code + 1] += 1) : 0));
    }
    scale.classes = scale.classes.map((one) => ({ ...one, count: counts[one.code + 1] }));
    for (const code of hidden) scale.table[4 * (code + 1) + 3] = 0;
  }
  state.scale = scale;
  points?.colour(scale);
  if (cloud.image.length > 0) image.paint(cloud, scale, theme.isDark() ? [24, 27, 35] : [226, 229, 234]);
  showLegend(element("legend"), scale, hidden, (code) => {
    if (!hidden.delete(code)) hidden.add(code);
    recolour();
  });
  ask();
}

// --- The view

const VIEWS = {
  all: (cloud) => frameAll(cloud, { yaw: -0.55, pitch: 0.5 }),
  above: (cloud) => frameAll(cloud, { yaw: 0, pitch: 1.55 }),
  left: (cloud) => frameAll(cloud, { yaw: -Math.PI / 2, pitch: 0.12 }),
  sensor: () => ({ yaw: 0, pitch: 0, target: [10, 0, 0], distance: 10 }),
};

// All of the cloud, but for its outermost hundredths, as large as the view holds it.
function frameAll({ bounds }, turn) {
  const canvas = element("cloud");
  const aspect = canvas.clientWidth / Math.max(canvas.clientHeight, 1);
  const trial = Object.assign(new Camera(), turn);
  trial.target = bounds.map(([low, high]) => (low + high) / 2);
  const corners = Array.from({ length: 8 }, (_, at) => bounds.map((ends, i) => ends[(at >> i) & 1]));
  // Where the corners lie: shares of the view from its middle, 1 at its edges.
  const spread = () => {
    const places = corners.map((corner) => projected(trial.matrix(aspect, 1), corner, 2, 2));
    if (places.includes(null)) return null;
    const ends = [0, 1].map((i) => places.map((place) => place[i] - 1));
    return ends.map((all) => [Math.min(...all), Math.max(...all)]);
  };
  const fits = ([[left, right], [top, bottom]]) => Math.max(right, -left) < 0.94 && Math.max(bottom, -top) < 0.86;
  // Nearness moves the middle, and the other way round; twice is close enough.
  for (let round = 0; round < 2; round += 1) {
    trial.distance = 0.5;
    while (trial.distance < 1e5 && !fits(spread() ?? [[-9, 9], [-9, 9]])) trial.distance *= 1.03;
    const [[left, right], [top, bottom]] = spread() ?? [[0, 0], [0, 0]];
    if (round === 0) trial.pan((-(left + right) / 4) * aspect, -(top + bottom) / 4);
  }
  return { ...turn, target: trial.target, distance: trial.distance };
}

function look(view) {
  Object.assign(camera, VIEWS[view](state.cloud));
  ask();
}

let asked = 0;
let before = 0;
let settling = 0;

// Asks for a picture at the next chance. A view that moves gets all of its points when it rests.
function ask(isMoving = false) {
  if (isMoving) {
    if (!state.isMoving) before = 0;
    state.isMoving = true;
    clearTimeout(settling);
    settling = setTimeout(() => {
      state.isMoving = false;
      ask();
    }, 160);
  }
  asked ||= requestAnimationFrame(draw);
}

function draw(now) {
  asked = 0;
  const { cloud } = state;
  if (!cloud) return;
  const canvas = element("cloud");
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const density = Math.min(window.devicePixelRatio || 1, 2);
  for (const one of [canvas, overlay.canvas]) {
    const [wide, high] = [Math.round(width * density), Math.round(height * density)];
    if (one.width !== wide || one.height !== high) [one.width, one.height] = [wide, high];
  }
  const reach = cloud.far + Math.hypot(...camera.target);
  const matrix = camera.matrix(width / height, reach);
  state.matrix = matrix;
  if (points) {
    if (state.isMoving && before) points.keepFluent(now - before);
    const drawn = points.draw(matrix, Number(element("size").value) * density, state.isMoving);
    document.body.dataset.drawn = String(drawn);
  }
  before = state.isMoving ? now : 0;
  const style = getComputedStyle(document.body);
  const colour = (name) => style.getPropertyValue(`--${name}`);
  overlay.halo = colour("paper");
  const colours = Object.fromEntries(
    [["grid", "rings"], ["soft", "soft"], ["ink", "ink"], ["x", "axis-x"], ["y", "axis-y"], ["z", "axis-z"]]
      .map(([part, name]) => [part, colour(name)]),
  );
  overlay.draw({ matrix, camera, width, height, density, ground: cloud.ground, reach: cloud.reach, colours });
  const { picked } = state;
  const marked = picked && picked.at >= 0 && projected(matrix, placeOf(picked.at), width, height);
  element("cloud-mark").hidden = !marked;
  if (marked) {
    element("cloud-mark").style.left = `${marked[0]}px`;
    element("cloud-mark").style.top = `${marked[1]}px`;
  }
}

function placeOf(at) {
  const { values, origin } = state.cloud;
  return [values.x, values.y, values.z].map((column, i) => column[at] - origin[i]);
}

// --- Picking

// Picks a point, by its place in the list, or a pixel; the other follows.
function pick(what) {
  const { cloud } = state;
  const { row, column } = cloud.values;
  let picked = null;
  if (what?.at >= 0) picked = { at: what.at, pixel: row ? [row[what.at], column[what.at]] : null };
  if (what?.pixel) {
    const at = cloud.image[what.pixel[0] * cloud.columns + what.pixel[1]];
    picked = { at, pixel: what.pixel };
  }
  state.picked = picked;
  element("no-point").hidden = picked !== null;
  if (picked?.at >= 0) {
    tell(element("point"), attributesOf(cloud, picked.at, outcomes));
  } else if (picked) {
    const code = cloud.outcomes?.[picked.pixel[0] * cloud.columns + picked.pixel[1]];
    const outcome = code === undefined ? [] : [["outcome", outcomes[code].name]];
    tell(element("point"), [
      ["row", String(picked.pixel[0])], ["column", String(picked.pixel[1])], ["range", "no return"], ...outcome,
    ]);
  } else {
    tell(element("point"), []);
  }
  const brief = element("brief");
  brief.hidden = picked === null;
  if (picked) {
    const range = picked.at >= 0 && cloud.values.range ? `${cloud.values.range[picked.at].toFixed(4)} m` : "no return";
    brief.textContent = picked.pixel ? `${range} \u00b7 row ${picked.pixel[0]}, column ${picked.pixel[1]}` : range;
  }
  image.mark(picked?.pixel);
  const section = picked?.pixel && element(`pixel-${picked.pixel[0]}-${picked.pixel[1]}`);
  element("to-pixel").hidden = !section;
  if (section) element("to-pixel").href = `#${section.id}`;
  ask();
}

function pickAt(x, y, reach) {
  const canvas = element("cloud");
  const size = Number(element("size").value);
  const at = points.under(state.matrix, [x, y, canvas.clientWidth, canvas.clientHeight], { size, reach });
  pick(at >= 0 ? { at } : null);
}

listenToCloud();
listenToImage();
listenToControls();
open(0).catch((failure) => say(`The points of this page cannot be read: ${failure.message}.`));
