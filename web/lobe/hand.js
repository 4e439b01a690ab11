// A pointer that is pressed and dragged on a plot, and the arrow keys while the plot has the focus.

const ARROWS = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

// `drag(event, last)` is called with the place before, in CSS pixels of the page; `read(event)` at every move; `step(right, up)`
// for an arrow.
export function watchHand(plot, { isPossible, drag, read, step }) {
  let last = null;
  plot.addEventListener("pointerdown", (event) => {
    if (!isPossible() || event.button !== 0) return;
    last = { x: event.clientX, y: event.clientY };
    plot.setPointerCapture(event.pointerId);
    drag(event, last);
  });
  plot.addEventListener("pointermove", (event) => {
    read(event);
    if (!last) return;
    drag(event, last);
    last = { x: event.clientX, y: event.clientY };
  });
  const release = () => {
    last = null;
  };
  plot.addEventListener("pointerup", release);
  plot.addEventListener("pointercancel", release);
  plot.addEventListener("keydown", (event) => {
    if (!(event.key in ARROWS)) return;
    event.preventDefault();
    event.stopPropagation();
    step(...ARROWS[event.key]);
  });
}
