// Camera moves out: mouse, touch and keys over the picture become orbit, pan and zoom.

const ORBIT_PER_WIDTH = Math.PI; // a drag across the picture goes half around
const KEY_ORBIT = Math.PI / 36;
const KEY_PAN = 0.05; // of the picture's height
const KEY_ZOOM = 1.1;
const WHEEL_ZOOM = 0.0015; // per CSS pixel of scrolling: a notch of 100 is 16 %
const WHEEL_UNITS = [1, 16, 400]; // pixels, lines, pages

const WHEEL_REST_MS = 400; // turns closer together are one step of undo

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

const middle = (points) => ({
  x: points.reduce((sum, p) => sum + p.x, 0) / points.length,
  y: points.reduce((sum, p) => sum + p.y, 0) / points.length,
  spread: points.length > 1 ? Math.hypot(points[0].x - points[1].x, points[0].y - points[1].y) : 0,
});

// `move` has orbit(right, down), pan(right, down), zoom(factor), and `rest()` after each gesture.
export function watchGestures(stage, move) {
  const fingers = new Map();
  let last = null;
  let panning = false;
  let turning = 0;

  stage.addEventListener("contextmenu", (event) => event.preventDefault());

  stage.addEventListener("pointerdown", (event) => {
    stage.setPointerCapture(event.pointerId);
    if (!fingers.size) panning = event.button !== 0 || event.shiftKey;
    if (event.button === 1) event.preventDefault(); // no autoscroll
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    last = middle([...fingers.values()]);
    stage.classList.add("held");
  });

  stage.addEventListener("pointermove", (event) => {
    if (!fingers.has(event.pointerId)) return;
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const now = middle([...fingers.values()]);
    const [right, down] = [now.x - last.x, now.y - last.y];
    if (fingers.size > 1 || panning) move.pan(right / stage.clientHeight, down / stage.clientHeight);
    else move.orbit((right / stage.clientWidth) * ORBIT_PER_WIDTH, (down / stage.clientWidth) * ORBIT_PER_WIDTH);
    if (last.spread > 0 && now.spread > 0) move.zoom(last.spread / now.spread);
    last = now;
  });

  const lift = (event) => {
    if (!fingers.delete(event.pointerId)) return;
    last = fingers.size ? middle([...fingers.values()]) : null;
    if (!fingers.size) {
      stage.classList.remove("held");
      move.rest();
    }
  };
  stage.addEventListener("pointerup", lift);
  stage.addEventListener("pointercancel", lift);

  stage.addEventListener("wheel", (event) => {
    event.preventDefault();
    clearTimeout(turning);
    turning = setTimeout(move.rest, WHEEL_REST_MS);
    move.zoom(Math.exp(event.deltaY * WHEEL_UNITS[event.deltaMode] * WHEEL_ZOOM * (event.ctrlKey ? 4 : 1)));
  }, { passive: false });
}

// Keys, wherever the focus is but in a control that needs them itself. `does` maps a key to an action.
export function watchKeys(move, does) {
  document.addEventListener("keydown", (event) => {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    if (event.target.closest("input, select, textarea, [contenteditable]")) return;
    if (event.key === " " && event.target.closest("button, summary, a")) return;
    const arrow = ARROWS[event.key];
    if (arrow) {
      const [right, down] = arrow;
      if (event.shiftKey) move.pan(right * KEY_PAN, down * KEY_PAN);
      else move.orbit(right * KEY_ORBIT, down * KEY_ORBIT);
    } else if (event.key === "+" || event.key === "=") move.zoom(1 / KEY_ZOOM);
    else if (event.key === "-" || event.key === "_") move.zoom(KEY_ZOOM);
    else if (does[event.key]) does[event.key]();
    else return;
    event.preventDefault();
  });
  document.addEventListener("keyup", (event) => { if (ARROWS[event.key] || "+=-_".includes(event.key)) move.rest(); });
}
