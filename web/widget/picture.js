// The picture of a notebook's view: frames onto a canvas, and a hand or keys that move its camera.

import { orbit, pan, zoom } from "../document/camera.js";
import { element } from "../lib/dom.js";
import { watchGestures } from "../picture/gestures.js";

const KEY_ORBIT = Math.PI / 24; // radians a key press
const KEY_ZOOM = 1.1;
const STEPS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const ZOOMS = { "+": 1 / KEY_ZOOM, "=": 1 / KEY_ZOOM, "-": KEY_ZOOM };

// `camera()` is the one in the document with all its members; `move(changes)` takes what is to change of it.
export function picture({ camera, move }) {
  const canvas = element("canvas", {
    tabindex: "0",
    role: "img",
    "aria-label": "Picture. Drag to orbit, with Shift to pan; arrow keys orbit, plus and minus zoom.",
  });
  const stage = element("div", { class: "stage" }, canvas);
  const by = (change, ...amounts) => move(change(camera(), ...amounts));

  watchGestures(
    canvas,
    {
      orbit: (right, down) => by(orbit, right, down),
      pan: (right, down) => by(pan, right, down),
      zoom: (factor) => by(zoom, factor),
      turn() {},
      look() {},
      slide() {},
      hover() {},
      tap() {},
      endGesture() {},
    },
    () => "orbit",
  );
  canvas.addEventListener("pointerdown", () => canvas.focus({ preventScroll: true }));
  // A wheel scrolls the notebook until the picture is in hand.
  stage.addEventListener(
    "wheel",
    (event) => {
      if (document.activeElement !== canvas && !event.ctrlKey) event.stopPropagation();
    },
    { capture: true },
  );
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const step = STEPS[event.key];
    if (step && event.shiftKey) by(pan, step[0] / 20, step[1] / 20);
    else if (step) by(orbit, step[0] * KEY_ORBIT, step[1] * KEY_ORBIT);
    else if (ZOOMS[event.key]) by(zoom, ZOOMS[event.key]);
    else return;
    event.preventDefault();
    event.stopPropagation();
  });

  let shown = { generation: -1, seq: -1 };
  return {
    element: stage,
    // Paints a frame, unless a newer one was painted meanwhile.
    async paint(frame, bytes) {
      const image = await createImageBitmap(new Blob([bytes], { type: frame.mime }));
      const isOlder = frame.generation < shown.generation;
      if (!isOlder) {
        shown = frame;
        Object.assign(canvas, { width: image.width, height: image.height });
        canvas.getContext("2d").drawImage(image, 0, 0);
        canvas.style.setProperty("aspect-ratio", `${image.width} / ${image.height}`);
      }
      image.close();
    },
  };
}
