// An item that a finger pulls out of a row, which scrolls sideways under it: a picture of it follows the finger until it
// is let go. A mouse drags by the browser's own means.

const STILL = 8; // CSS pixels that a finger moves before its direction is known

// `find(target)` is the item under a finger or null; `take(item)` when it is pulled out, then `move(x, y)`, and at last
// `drop(x, y)` or `leave()`.
export function watchPull(row, find, { take, move, drop, leave }) {
  let finger = null; // {id, x, y, item, ghost}

  const end = () => {
    finger?.ghost?.remove();
    finger = null;
  };
  row.addEventListener("pointerdown", ({ pointerType, pointerId: id, clientX: x, clientY: y, target }) => {
    const item = find(target);
    if (pointerType !== "mouse" && item && !finger) finger = { id, x, y, item, ghost: null };
  });
  row.addEventListener("pointermove", ({ pointerId, clientX, clientY }) => {
    if (pointerId !== finger?.id) return;
    const [right, down] = [Math.abs(clientX - finger.x), Math.abs(clientY - finger.y)];
    if (!finger.ghost) {
      if (Math.max(right, down) < STILL) return;
      if (right > down) return end();
      row.setPointerCapture(pointerId);
      finger.ghost = finger.item.querySelector("img").cloneNode();
      finger.ghost.className = "pulled";
      document.body.append(finger.ghost);
      take(finger.item);
    }
    finger.ghost.style.setProperty("translate", `${clientX}px ${clientY}px`);
    move(clientX, clientY);
  });
  row.addEventListener("pointerup", ({ pointerId, clientX, clientY }) => {
    if (pointerId !== finger?.id) return;
    const isPulled = finger.ghost !== null;
    end();
    if (isPulled) drop(clientX, clientY);
  });
  row.addEventListener("pointercancel", ({ pointerId }) => {
    if (pointerId !== finger?.id) return;
    const isPulled = finger.ghost !== null;
    end();
    if (isPulled) leave();
  });
}
