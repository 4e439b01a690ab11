// A hand that drags something: what it says from the press to the release, of one pointer.

// `begin(event)` gives {move(event), end(isCancelled)} of a drag, or null where none begins there.
export function watchDrags(root, begin) {
  let drag = null;
  let pointer = null;
  const end = (isCancelled) => {
    const ended = drag;
    drag = null;
    ended.end(isCancelled);
  };
  root.addEventListener("pointerdown", (event) => {
    if (drag || event.button !== 0) return;
    drag = begin(event);
    if (!drag) return;
    event.preventDefault();
    event.stopPropagation(); // else the picture would orbit
    pointer = event.pointerId;
    root.setPointerCapture(pointer);
  });
  root.addEventListener("pointermove", (event) => {
    if (drag && event.pointerId === pointer) drag.move(event);
  });
  root.addEventListener("lostpointercapture", (event) => {
    if (drag && event.pointerId === pointer) end(false);
  });
  root.ownerDocument.addEventListener(
    "keydown",
    (event) => {
      if (!drag || event.key !== "Escape") return;
      event.stopPropagation();
      end(true);
    },
    true,
  );
}
