// Camera moves out: mouse, touch and keys over the picture become orbit, look, pan, zoom, and taps.

const ORBIT_PER_WIDTH = Math.PI; // a drag across the picture goes half around
const LOOK_PER_WIDTH = Math.PI / 3;
const WHEEL_ZOOM = 0.0015; // per CSS pixel of scrolling: a notch of 100 is 16 %
const WHEEL_UNITS = [1, 16, 400]; // pixels, lines, pages
const STILL = 4; // CSS pixels that a hand may slip during a tap

const WHEEL_REST_MS = 400; // turns closer together are one step of undo

const middle = (points) => ({
  x: points.reduce((sum, p) => sum + p.x, 0) / points.length,
  y: points.reduce((sum, p) => sum + p.y, 0) / points.length,
  spread: points.length > 1 ? Math.hypot(points[0].x - points[1].x, points[0].y - points[1].y) : 0,
});

// `move` has orbit(right, down), look(right, down), pan(right, down), zoom(factor, x, y), turn(right) of the
// environment, slide(right, down) of the magnified picture, tap(x, y, isAlt), hover(x, y) and
// `endGesture()` after each gesture.
// `tool()` is the one in the hand: orbit, fly, focus, inspect, ...
export function watchGestures(stage, move, tool) {
  const fingers = new Map();
  let last = null;
  let began = null;
  let kind = "orbit";
  let turning = 0;

  stage.addEventListener("contextmenu", (event) => event.preventDefault());

  const meaning = (event) => {
    if (tool() === "inspect") return "slide";
    if (event.button !== 0 || event.shiftKey) return "pan";
    if (event.altKey) return "turn";
    return tool() === "fly" ? "look" : "orbit";
  };

  const drag = (right, down) => {
    const [w, h] = [stage.clientWidth, stage.clientHeight];
    if (kind === "slide") move.slide(right, down);
    else if (fingers.size > 1 || kind === "pan") move.pan(right / h, down / h);
    else if (kind === "turn") move.turn(right / w);
    else if (kind === "look") move.look((right / w) * LOOK_PER_WIDTH, (down / w) * LOOK_PER_WIDTH);
    else move.orbit((right / w) * ORBIT_PER_WIDTH, (down / w) * ORBIT_PER_WIDTH);
  };

  stage.addEventListener("pointerdown", (event) => {
    stage.setPointerCapture(event.pointerId);
    if (event.button === 1) event.preventDefault(); // no autoscroll
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    last = middle([...fingers.values()]);
    if (fingers.size === 1) {
      kind = meaning(event);
      began = event.button === 0 ? last : null;
    } else began = null;
  });

  stage.addEventListener("pointermove", (event) => {
    move.hover(event.clientX, event.clientY);
    if (!fingers.has(event.pointerId)) return;
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const now = middle([...fingers.values()]);
    if (began && Math.hypot(now.x - began.x, now.y - began.y) < STILL) return;
    began = null;
    stage.classList.add("held");
    drag(now.x - last.x, now.y - last.y);
    if (last.spread > 0 && now.spread > 0) move.zoom(last.spread / now.spread, now.x, now.y);
    last = now;
  });

  const lift = (event) => {
    if (!fingers.delete(event.pointerId)) return;
    last = fingers.size ? middle([...fingers.values()]) : null;
    if (fingers.size) return;
    stage.classList.remove("held");
    if (began && event.type === "pointerup") move.tap(event.clientX, event.clientY, event.altKey);
    else move.endGesture();
    began = null;
  };
  stage.addEventListener("pointerup", lift);
  stage.addEventListener("pointercancel", lift);

  stage.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      clearTimeout(turning);
      turning = setTimeout(move.endGesture, WHEEL_REST_MS);
      const scrolled = event.deltaY * WHEEL_UNITS[event.deltaMode] * WHEEL_ZOOM * (event.ctrlKey ? 4 : 1);
      move.zoom(Math.exp(scrolled), event.clientX, event.clientY);
    },
    { passive: false },
  );
}
