// One floating hint for all controls: under the pointer after a moment, at once for the keyboard.
// Screen readers have the same words by aria-describedby, so the bubble itself is hidden from them.

import { element } from "./dom.js";

const PATIENCE_MS = 350;
const WRITTEN = ["text", "button"]; // :focus-visible by a mere click; a hint would be in the way
const bubble = element("div", { class: "tooltip", "aria-hidden": "true", hidden: true });
let timer = 0;

function open(row, text) {
  bubble.textContent = text;
  document.body.append(bubble);
  bubble.hidden = false;
  const box = row.getBoundingClientRect();
  const below = box.bottom + bubble.offsetHeight + 8 < window.innerHeight;
  bubble.style.setProperty(
    "left",
    `${Math.max(8, Math.min(box.left, window.innerWidth - bubble.offsetWidth - 8))}px`,
  );
  bubble.style.setProperty("top", `${below ? box.bottom + 4 : box.top - bubble.offsetHeight - 4}px`);
}

function closeTooltip() {
  clearTimeout(timer);
  bubble.hidden = true;
}

export function describe(row, handle, text) {
  handle.addEventListener("pointerenter", () => {
    clearTimeout(timer);
    timer = setTimeout(open, PATIENCE_MS, row, text);
  });
  handle.addEventListener("pointerleave", closeTooltip);
  row.addEventListener("focusin", ({ target }) => {
    if (!WRITTEN.includes(target.type) && target.matches(":focus-visible")) open(row, text);
  });
  row.addEventListener("focusout", closeTooltip);
  row.addEventListener("pointerdown", closeTooltip);
  row.addEventListener("keydown", (event) => {
    if (event.key === "Escape") closeTooltip();
  });
}
