// A name that is written where it stands: a field over it. Enter or going elsewhere takes the name, Escape does not.

import { element, freshId } from "./dom.js";

const EDGE = 6; // CSS pixels that the field keeps from the window's edge

// Resolves to the new name, or null; `problem(name)` says what is wrong with one, or null.
export function nameInPlace(anchor, { label, value, problem }) {
  return new Promise((resolve) => {
    const id = freshId("naming");
    const trouble = element("p", { class: "trouble", id, role: "alert", hidden: true });
    const entry = element("input", {
      class: "entry",
      value,
      "aria-label": label,
      "aria-describedby": id,
      autocomplete: "off",
      spellcheck: "false",
    });
    const field = element("div", { class: "naming" }, entry, trouble);
    let isDone = false;
    const finish = (name) => {
      if (isDone) return; // a field that goes loses the focus
      isDone = true;
      field.remove();
      resolve(name);
    };
    const said = () => problem(entry.value.trim());
    entry.addEventListener("keydown", (event) => {
      event.stopPropagation(); // the page has other uses for keys
      if (event.key === "Escape") return finish(null);
      if (event.key !== "Enter") return;
      event.preventDefault();
      const wrong = said();
      trouble.hidden = !wrong;
      trouble.textContent = wrong ?? "";
      entry.setAttribute("aria-invalid", String(Boolean(wrong)));
      if (!wrong) finish(entry.value.trim());
    });
    entry.addEventListener("blur", () => finish(said() ? null : entry.value.trim()));
    document.body.append(field);
    const { left, top, width, height } = anchor.getBoundingClientRect();
    const most = innerWidth - field.offsetWidth - EDGE;
    field.style.setProperty("left", `${Math.max(EDGE, Math.min(left + (width - field.offsetWidth) / 2, most))}px`);
    field.style.setProperty("top", `${top + (height - entry.offsetHeight) / 2}px`);
    entry.select();
    entry.focus();
  });
}
