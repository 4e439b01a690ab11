// A slider under a finger. Browsers move a slider as soon as a finger comes down on its track, also where that
// finger is about to scroll the page. Here a slider follows a finger that goes sideways, by as much as it goes,
// and jumps to a finger that taps.

const STILL = 6; // CSS pixels that a finger moves before its direction is known
const GLIDE_MS = 100; // after a scroll event: a finger that comes down now stops a gliding panel

let scrolled = -Infinity;
document.addEventListener(
  "scroll",
  () => {
    scrolled = performance.now();
  },
  { capture: true, passive: true },
);

// `input(value)` is called while a finger slides or taps, `commit()` when it is lifted.
export function slideByTouch(range, { input, commit }) {
  let finger = null; // {id, x, y, from, isSliding, value}: where it came down, and the value that it began with

  const set = (from, pixels) => {
    const [min, max] = [Number(range.min), Number(range.max)];
    range.value = String(from + (pixels / range.clientWidth) * (max - min));
    input(range.valueAsNumber);
  };

  // What the browser makes of the touch is undone before anybody else hears of it.
  range.addEventListener(
    "input",
    (event) => {
      if (!finger) return;
      event.stopImmediatePropagation();
      range.value = String(finger.value);
    },
    { capture: true },
  );

  range.addEventListener("pointerdown", ({ pointerType, pointerId: id, clientX: x, clientY: y }) => {
    if (pointerType !== "touch" || finger) return;
    const value = range.valueAsNumber;
    finger = { id, x, y, from: value, value, isSliding: false, isTap: performance.now() - scrolled > GLIDE_MS };
  });
  range.addEventListener("pointermove", ({ pointerId, clientX, clientY }) => {
    if (pointerId !== finger?.id) return;
    const [right, down] = [Math.abs(clientX - finger.x), Math.abs(clientY - finger.y)];
    if (right > STILL || down > STILL) finger.isTap = false;
    // From here on, so that the first pixels are no jump.
    if (!finger.isSliding && right > STILL && right > down) Object.assign(finger, { isSliding: true, x: clientX });
    if (!finger.isSliding) return;
    set(finger.from, clientX - finger.x);
    finger.value = range.valueAsNumber;
  });
  const lift = ({ pointerId, type }) => {
    if (pointerId !== finger?.id) return;
    const { x, isSliding, isTap } = finger;
    finger = null;
    const isTapped = isTap && type === "pointerup";
    if (isTapped) set(Number(range.min), x - range.getBoundingClientRect().left);
    if (isTapped || isSliding) commit();
  };
  range.addEventListener("pointerup", lift);
  range.addEventListener("pointercancel", lift);
}
