// What is drawn over the points: rings of range, axes, the scale bar.

class Overlay {
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = canvas.getContext("2d");
  }

  // Draws for a view. `ground` is the height of the rings, `reach` how far they go; lengths in m.
  draw({ matrix, camera, width, height, density, ground, reach, colours }) {
    const { pen } = this;
    pen.setTransform(density, 0, 0, density, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.font = "12px ui-sans-serif, system-ui, sans-serif";
    pen.textBaseline = "middle";
    const place = (point) => projected(matrix, point, width, height);
    const step = roundBelow(reach / 3);
    for (let radius = step; radius <= reach + step / 2; radius += step) {
      this.#ring(place, [radius, ground], colours);
    }
    const length = step / 2;
    const axes = [
      [[length, 0, 0], "x", colours.x],
      [[0, length, 0], "y", colours.y],
      [[0, 0, length], "z", colours.z],
    ];
    for (const [tip, name, colour] of axes) this.#stroke(place([0, 0, 0]), place(tip), name, colour);
    // The same three in the corner, where they are always seen.
    const [right, up] = camera.axes;
    const middle = [width - 44, height - 44];
    for (const [at, [, name, colour]] of axes.entries()) {
      const tip = [middle[0] + 26 * right[at], middle[1] - 26 * up[at]];
      this.#stroke(middle, tip, name, colour);
    }
    this.#bar(camera.scale(height), height, colours);
  }

  #ring(place, [radius, ground], colours) {
    const { pen } = this;
    pen.strokeStyle = colours.grid;
    pen.lineWidth = 1;
    pen.beginPath();
    let before = null;
    for (let at = 0; at <= 120; at += 1) {
      const angle = (at / 60) * Math.PI;
      const next = place([radius * Math.cos(angle), radius * Math.sin(angle), ground]);
      if (before && next) {
        pen.moveTo(before[0], before[1]);
        pen.lineTo(next[0], next[1]);
      }
      before = next;
    }
    pen.stroke();
    const label = place([radius, 0, ground]);
    if (label) this.#text(`${metres(radius)}`, label[0], label[1], colours.soft, "center");
  }

  #stroke(from, to, name, colour) {
    if (!from || !to) return;
    const { pen } = this;
    pen.strokeStyle = colour;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.moveTo(from[0], from[1]);
    pen.lineTo(to[0], to[1]);
    pen.stroke();
    const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    const long = Math.hypot(dx, dy);
    if (long > 8) this.#text(name, to[0] + (9 * dx) / long, to[1] + (9 * dy) / long, colour, "center");
  }

  #text(text, x, y, colour, align) {
    const { pen } = this;
    pen.textAlign = align;
    pen.lineWidth = 3;
    pen.lineJoin = "round";
    pen.strokeStyle = this.halo;
    pen.strokeText(text, x, y);
    pen.fillStyle = colour;
    pen.fillText(text, x, y);
  }

  #bar(pixels, height, colours) {
    const { pen } = this;
    const length = roundBelow(140 / pixels);
    const [left, right, y] = [16, 16 + length * pixels, height - 18];
    pen.strokeStyle = colours.ink;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.moveTo(left, y - 5);
    pen.lineTo(left, y);
    pen.lineTo(right, y);
    pen.lineTo(right, y - 5);
    pen.stroke();
    this.#text(`${metres(length)} at the centre`, left, y - 14, colours.ink, "left");
  }
}

// The greatest of 1, 2, 5, 10, 20 … that is not above `value`.
function roundBelow(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [5, 2, 1].find((digit) => digit * power <= value * (1 + 1e-9)) * power;
}

function metres(length) {
  if (length >= 1000) return `${Number((length / 1000).toPrecision(6))} km`;
  return length >= 0.1 ? `${Number(length.toPrecision(6))} m` : `${Number((length * 1000).toPrecision(6))} mm`;
}
