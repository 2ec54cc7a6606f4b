// Pointers, wheels and keys.

function listenToCloud() {
  const canvas = element("cloud");
  const down = new Map();
  let travelled = 0;
  const place = (event) => [event.clientX, event.clientY];
  const spread = () => {
    const [a, b] = [...down.values()];
    return [Math.hypot(a[0] - b[0], a[1] - b[1]), (a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    if (down.size === 0) travelled = 0;
    down.set(event.pointerId, place(event));
  });
  canvas.addEventListener("pointermove", (event) => {
    const from = down.get(event.pointerId);
    if (!from) return;
    const [x, y] = place(event);
    const [dx, dy] = [x - from[0], y - from[1]];
    travelled += Math.abs(dx) + Math.abs(dy);
    const height = canvas.clientHeight;
    if (down.size === 2) {
      const [apart, cx, cy] = spread();
      down.set(event.pointerId, [x, y]);
      const [wider, nx, ny] = spread();
      camera.zoom(apart / Math.max(wider, 1));
      camera.pan((nx - cx) / height, (ny - cy) / height);
    } else {
      down.set(event.pointerId, [x, y]);
      if (travelled < 4) return;
      if (event.shiftKey || event.buttons === 2 || event.buttons === 4) camera.pan(dx / height, dy / height);
      else camera.orbit((dx / height) * 3, (dy / height) * 3);
    }
    ask(true);
  });
  const release = (event) => {
    const wasClick = down.delete(event.pointerId) && down.size === 0 && travelled < 4;
    if (event.type === "pointerup" && wasClick && event.button === 0 && points) {
      const box = canvas.getBoundingClientRect();
      pickAt(event.clientX - box.left, event.clientY - box.top, event.pointerType === "touch" ? 20 : 10);
    }
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    camera.zoom(Math.exp(Math.min(Math.max(event.deltaY, -200), 200) * 0.0015));
    ask(true);
  }, { passive: false });
  canvas.addEventListener("dblclick", () => {
    if (state.picked?.at >= 0) {
      camera.target = placeOf(state.picked.at);
      ask();
    }
  });
  const step = 0.08;
  const turns = {
    ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1],
  };
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const turn = turns[event.key];
    if (turn && event.shiftKey) camera.pan(turn[0] * step, turn[1] * step);
    else if (turn) camera.orbit(turn[0] * step, turn[1] * step);
    else if (event.key === "+" || event.key === "=") camera.zoom(0.85);
    else if (event.key === "-") camera.zoom(1 / 0.85);
    else if (event.key === "0") look("all");
    else if (event.key === "Enter") pickAt(canvas.clientWidth / 2, canvas.clientHeight / 2, canvas.clientHeight / 3);
    else if (event.key === "Escape") pick(null);
    else return;
    event.preventDefault();
    ask(true);
  });
  new ResizeObserver(() => ask()).observe(canvas);
}

function listenToImage() {
  const canvas = element("image");
  const pickUnder = (event) => state.cloud && pick({ pixel: image.pixelAt(event) });
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pickUnder(event);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons === 1) pickUnder(event);
  });
  const steps = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] };
  canvas.addEventListener("keydown", (event) => {
    const step = steps[event.key];
    if (!step || !state.cloud) return;
    event.preventDefault();
    const { rows, columns } = state.cloud;
    const from = state.picked?.pixel ?? [rows >> 1, columns >> 1];
    const far = event.shiftKey ? 10 : 1;
    const within = (value, count) => Math.min(Math.max(value, 0), count - 1);
    pick({ pixel: [within(from[0] + far * step[0], rows), within(from[1] + far * step[1], columns)] });
  });
}

function listenToControls() {
  const scan = element("scan");
  element("colour").addEventListener("change", () => {
    state.hidden.clear();
    recolour();
  });
  element("size").addEventListener("input", () => ask());
  scan.addEventListener("change", () => open(Number(scan.value)));
  for (const [id, step] of [["earlier", -1], ["later", 1]]) {
    element(id).addEventListener("click", () => {
      const count = scan.options.length;
      scan.value = String((Number(scan.value) + step + count) % count);
      open(Number(scan.value));
    });
  }
  for (const button of document.querySelectorAll("[data-view]")) {
    button.addEventListener("click", () => look(button.dataset.view));
  }
  theme.changed = () => state.cloud && recolour();
}
