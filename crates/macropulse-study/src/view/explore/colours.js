// What a colour means: a scale gives every point a shade, 0 … 255, and every shade a colour.
//
// Shade 0 is "no value". A ramp has its lowest value at shade 1 and its highest at 255; a scale of
// classes has class c at shade c + 1.

// CIE L*a*b* (D65) to sRGB, 0 … 1 each; outside of that where no screen shows the colour.
function rgbOfLab(lightness, a, b) {
  const fy = (lightness + 16) / 116;
  const linear = (f) => (f > 6 / 29 ? f ** 3 : 3 * (6 / 29) ** 2 * (f - 4 / 29));
  const [x, y, z] = [0.95047 * linear(fy + a / 500), linear(fy), 1.08883 * linear(fy - b / 200)];
  return [
    3.2404542 * x - 1.5371385 * y - 0.4985314 * z,
    -0.969266 * x + 1.8760108 * y + 0.041556 * z,
    0.0556434 * x - 0.2040259 * y + 1.0572252 * z,
  ].map((light) => (light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055));
}

// The ramp: L* rises in even steps, which every eye can tell apart, while the hue goes from violet
// over blue and green to yellow. On a dark ground it begins lighter, on a light one it ends darker.
function ramp(isDark) {
  const [darkest, lightest] = isDark ? [36, 95] : [18, 84];
  const table = new Uint8ClampedArray(256 * 4);
  for (let shade = 1; shade < 256; shade += 1) {
    const place = (shade - 1) / 254;
    const lightness = darkest + place * (lightest - darkest);
    const hue = ((310 - 208 * place) * Math.PI) / 180;
    // As colourful as screens can just show at this lightness and hue: least of all in the middle.
    const chroma = (isDark ? 33 : 26) + 120 * (place - 0.4) ** 2;
    const rgb = rgbOfLab(lightness, chroma * Math.cos(hue), chroma * Math.sin(hue));
    table.set([...rgb.map((part) => Math.round(part * 255)), 255], shade * 4);
  }
  table.set(isDark ? [90, 96, 110, 255] : [170, 175, 185, 255], 0);
  return table;
}

// Colours of classes without an order, by Okabe & Ito: none is mistaken for another by any eye.
const APART = [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [213, 94, 0]];

// What clouds can be coloured by: the column, its title, and for classes their names and colours.
function colourings(cloud, outcomes) {
  const ramps = [
    ["range", "Range", "m"],
    ["intensity", "Intensity", ""],
    ["row", "Ring (row)", ""],
    ["z", "Height z", "m"],
    ["radial_velocity", "Radial velocity", "m/s"],
  ].map(([column, title, unit]) => ({ column, title, unit }));
  const numbers = APART.map((colour, at) => ({ code: at + 1, name: String(at + 1), colour }));
  const classes = [
    { column: "outcome", title: "Outcome", classes: outcomes },
    { column: "return_number", title: "Return number", classes: numbers },
  ];
  return [...ramps, ...classes].filter(({ column }) => column in cloud.values);
}

// Shades and colours of a cloud by a colouring. A ramp is stretched between the 1st and the 99th
// percentile; where the middle of the values is one value, between the lowest and the highest.
function scaleOf(cloud, colouring, isDark) {
  const values = cloud.values[colouring.column];
  const shades = new Uint8Array(values.length);
  if (colouring.classes) {
    const known = colouring.classes;
    const table = new Uint8ClampedArray(256 * 4);
    table.set([128, 128, 128, 255], 0);
    for (const { code, colour } of known) table.set([...colour, 255], (code + 1) * 4);
    const highest = Math.max(...known.map(({ code }) => code));
    for (let at = 0; at < values.length; at += 1) {
      shades[at] = Number.isNaN(values[at]) ? 0 : 1 + Math.min(values[at], highest);
    }
    return { ...colouring, shades, table };
  }
  let [low, high] = percentiles(values, [0.01, 0.99]);
  const isCut = low < high;
  if (!isCut) [low, high] = percentiles(values, [0, 1]);
  const span = high - low || 1;
  for (let at = 0; at < values.length; at += 1) {
    const place = Math.min(Math.max((values[at] - low) / span, 0), 1);
    shades[at] = Number.isNaN(place) ? 0 : 1 + Math.round(254 * place);
  }
  return { ...colouring, shades, table: ramp(isDark), low, high, isCut };
}
