// Draws points by WebGL 2, and finds the one under a pointer.
//
// The points lie in the memory of the graphics unit in a shuffled order, so that the first thousands
// of them are a fair choice of all: while the view moves only as many are drawn as keep it fluent.

const VERTEX = `#version 300 es
in vec3 place;
in float shade;
uniform mat4 matrix;
uniform float size;
uniform sampler2D table;
out vec4 colour;
void main() {
  colour = texelFetch(table, ivec2(int(shade + 0.5), 0), 0);
  // What is hidden has no opacity, and goes where nothing is drawn.
  gl_Position = colour.a > 0.0 ? matrix * vec4(place, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
  gl_PointSize = size;
}`;

const FRAGMENT = `#version 300 es
precision mediump float;
in vec4 colour;
out vec4 seen;
void main() { seen = colour; }`;

// Points drawn while the view moves, at least and at first; how long a picture of it may take.
const FEWEST = 30000;
const AT_FIRST = 100000;
const FLUENT_MS = 33;

class Points {
  // Fails with a sentence where there is no WebGL 2.
  constructor(canvas) {
    this.canvas = canvas;
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: true });
    if (!gl) throw new Error("this browser has no WebGL 2, which draws the points");
    this.gl = gl;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
      throw new Error(`WebGL refused the program of the page: ${gl.getProgramInfoLog(program)}`);
    }
    gl.useProgram(program);
    gl.enable(gl.DEPTH_TEST);
    this.uniforms = Object.fromEntries(
      ["matrix", "size", "table"].map((name) => [name, gl.getUniformLocation(program, name)]),
    );
    this.places = this.#buffer(program, "place", 3, gl.FLOAT);
    this.shades = this.#buffer(program, "shade", 1, gl.UNSIGNED_BYTE);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    this.count = 0;
  }

  #buffer(program, name, parts, type) {
    const { gl } = this;
    const buffer = gl.createBuffer();
    const location = gl.getAttribLocation(program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(location, parts, type, false, 0, 0);
    return buffer;
  }

  // Takes places, x y z of one point after the other.
  load(places) {
    this.count = places.length / 3;
    this.at = places;
    this.order = shuffled(this.count);
    this.budget = AT_FIRST;
    const inOrder = new Float32Array(places.length);
    this.order.forEach((from, to) => {
      inOrder.set(places.subarray(3 * from, 3 * from + 3), 3 * to);
    });
    this.#fill(this.places, inOrder);
  }

  // Takes the shade of each point and the table of their colours.
  colour({ shades, table }) {
    this.#fill(this.shades, Uint8Array.from(this.order, (from) => shades[from]));
    this.shadeOf = shades;
    this.table = table;
    const { gl } = this;
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, table);
  }

  #fill(buffer, values) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
  }

  // Draws all points, or as many as a moving view allows; gives how many.
  draw(matrix, size, isMoving) {
    const { gl, canvas } = this;
    const count = isMoving ? Math.min(this.count, this.budget) : this.count;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix4fv(this.uniforms.matrix, false, matrix);
    gl.uniform1f(this.uniforms.size, size);
    gl.drawArrays(gl.POINTS, 0, count);
    return count;
  }

  // Takes how long it was between two pictures of a moving view, ms, and draws fewer or more.
  keepFluent(elapsed) {
    const drawn = Math.min(this.count, this.budget);
    let wanted = drawn;
    if (elapsed > 1.3 * FLUENT_MS) wanted *= Math.max(0.4, FLUENT_MS / elapsed);
    if (elapsed < 0.7 * FLUENT_MS) wanted *= 1.2;
    this.budget = Math.round(Math.max(wanted, FEWEST));
  }

  // The point that is seen at x, y of a screen, both in pixels from the top left; -1 for none. Of
  // those whose `size` covers the place the nearest to the eye, else the nearest on the screen within
  // `reach`.
  under(matrix, [x, y, width, height], { size, reach }) {
    const m = matrix;
    const { at, count, shadeOf, table } = this;
    const covers = size / 2 + 0.5;
    let [best, bestOff, front, frontDepth] = [-1, reach * reach, -1, Infinity];
    for (let i = 0, j = 0; i < count; i += 1, j += 3) {
      const depth = m[3] * at[j] + m[7] * at[j + 1] + m[11] * at[j + 2] + m[15];
      if (depth <= 0) continue;
      const dx = (0.5 + (0.5 * (m[0] * at[j] + m[4] * at[j + 1] + m[8] * at[j + 2] + m[12])) / depth) * width - x;
      if (dx > reach || dx < -reach) continue;
      const dy = (0.5 - (0.5 * (m[1] * at[j] + m[5] * at[j + 1] + m[9] * at[j + 2] + m[13])) / depth) * height - y;
      const off = dx * dx + dy * dy;
      if (off >= reach * reach || table[4 * shadeOf[i] + 3] === 0) continue;
      if (off < covers * covers && depth < frontDepth) [front, frontDepth] = [i, depth];
      if (off < bestOff) [best, bestOff] = [i, off];
    }
    return front >= 0 ? front : best;
  }
}

// The numbers below `count` in an order without a pattern, the same each time.
function shuffled(count) {
  const order = Uint32Array.from({ length: count }, (_, at) => at);
  let state = 1;
  for (let at = count - 1; at > 0; at -= 1) {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    const other = Math.floor((state / 2 ** 32) * (at + 1));
    [order[at], order[other]] = [order[other], order[at]];
  }
  return order;
}
