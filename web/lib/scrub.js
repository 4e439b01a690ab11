// A label whose number follows a hand that drags it sideways.

const STILL = 3; // CSS pixels that a hand moves before it is no click
const PACE = 2; // CSS pixels for a step; with Shift for ten

// `begin()` is called when the drag is sure, `move(steps)` with how many steps the hand is away from there, `end()` when it
// is let go, and `cancel()` where Escape is pressed before. Returns the label.
export function scrubBy(label, { begin, move, end, cancel }) {
  let hand = null; // {id, x, from, steps, isScrubbing}

  const finish = (how) => {
    const was = hand;
    hand = null;
    document.removeEventListener("keydown", escape, true);
    if (!was?.isScrubbing) return;
    const swallow = (event) => event.preventDefault(); // the click that ends a drag is none
    label.addEventListener("click", swallow);
    setTimeout(() => label.removeEventListener("click", swallow));
    how();
  };
  const escape = (event) => {
    if (event.key !== "Escape") return;
    event.stopPropagation();
    finish(cancel);
  };
  label.classList.add("scrubs");
  label.addEventListener("pointerdown", ({ button, pointerId: id, clientX: x }) => {
    if (button !== 0 || hand) return;
    hand = { id, x, steps: 0, isScrubbing: false };
    label.setPointerCapture(id); // the letter of an axis is left before the drag is sure
  });
  label.addEventListener("pointermove", ({ pointerId, clientX, shiftKey }) => {
    if (pointerId !== hand?.id) return;
    if (!hand.isScrubbing) {
      if (Math.abs(clientX - hand.x) < STILL) return;
      hand.isScrubbing = true;
      document.addEventListener("keydown", escape, true);
      begin();
    }
    const steps = Math.trunc((clientX - hand.x) / PACE);
    if (!steps) return;
    hand.x += steps * PACE;
    hand.steps += steps * (shiftKey ? 10 : 1);
    move(hand.steps);
  });
  for (const type of ["pointerup", "pointercancel"])
    label.addEventListener(type, ({ pointerId }) => {
      if (pointerId === hand?.id) finish(end);
    });
  return label;
}
