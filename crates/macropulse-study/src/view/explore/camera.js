// A camera that orbits a point, z up. Angles in radians: at yaw 0 and pitch 0 it looks forward,
// along x; a positive yaw looks to the left, a positive pitch down.

const FIELD = (50 * Math.PI) / 180; // of view, from top to bottom

class Camera {
  constructor() {
    this.target = [0, 0, 0];
    this.distance = 10;
    this.yaw = 0;
    this.pitch = 0.35;
  }

  // Unit vectors: right, up, forward.
  get axes() {
    const [cy, sy, cp, sp] = [
      Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch),
    ];
    return [[sy, -cy, 0], [cy * sp, sy * sp, cp], [cp * cy, cp * sy, -sp]];
  }

  get eye() {
    const forward = this.axes[2];
    return this.target.map((place, i) => place - this.distance * forward[i]);
  }

  // From places to clip space, column by column, as WebGL takes it. `reach` is how far the farthest
  // thing lies from the target, m.
  matrix(aspect, reach) {
    const [right, up, forward] = this.axes;
    const eye = this.eye;
    const lens = 1 / Math.tan(FIELD / 2);
    const near = this.distance / 200;
    const far = this.distance + 2 * reach + 1;
    const depth = [(far + near) / (far - near), (-2 * far * near) / (far - near)];
    const along = (axis) => -(axis[0] * eye[0] + axis[1] * eye[1] + axis[2] * eye[2]);
    const rows = [
      [...right, along(right)].map((part) => (part * lens) / aspect),
      [...up, along(up)].map((part) => part * lens),
      [...forward, along(forward)].map((part, i) => part * depth[0] + (i === 3 ? depth[1] : 0)),
      [...forward, along(forward)],
    ];
    return Float32Array.from({ length: 16 }, (_, at) => rows[at % 4][at >> 2]);
  }

  orbit(dx, dy) {
    this.yaw -= dx;
    this.pitch = Math.min(Math.max(this.pitch + dy, -1.55), 1.55);
  }

  // Moves along the screen, by shares of its height.
  pan(dx, dy) {
    const [right, up] = this.axes;
    const span = 2 * this.distance * Math.tan(FIELD / 2);
    this.target = this.target.map((place, i) => place - span * (dx * right[i] - dy * up[i]));
  }

  zoom(factor) {
    this.distance = Math.min(Math.max(this.distance * factor, 0.05), 1e5);
  }

  // Pixels per metre at the target, on a screen so high.
  scale(height) {
    return height / (2 * this.distance * Math.tan(FIELD / 2));
  }
}

// Where a place lies on a screen: x and y from the top left, and the depth; nothing if it is behind.
function projected(matrix, [x, y, z], width, height) {
  const at = (row) => matrix[row] * x + matrix[row + 4] * y + matrix[row + 8] * z + matrix[row + 12];
  const depth = at(3);
  if (depth <= 1e-6 || at(2) < -depth) return null;
  return [(0.5 + (0.5 * at(0)) / depth) * width, (0.5 - (0.5 * at(1)) / depth) * height, depth];
}
