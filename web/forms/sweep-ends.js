// From where to where a parameter is swept: two numbers, or two colours.

import { worded } from "./amounts.js";
import { UNSET, numberEntry } from "./number-controls.js";
import { hex, linear } from "../lib/color.js";
import { element, freshId } from "../lib/dom.js";
import { isColor } from "../document/sweep.js";

const NAMES = { from: "From", to: "To" };

export class SweepEnds {
  value = { from: 0, to: 1 };

  // `changed()` is called when the hand has set one of them.
  constructor(changed) {
    this.changed = changed;
    this.element = element("div", { class: "ends" });
  }

  // `ends`: what they are at first.
  show(field, ends) {
    this.value = ends;
    const parts = Object.entries(NAMES).map(([name, title]) => this.#part(field, name, title));
    this.element.replaceChildren(...parts.map((part) => part.element));
  }

  #part(field, name, title) {
    const id = freshId(`sweep-${name}`);
    const take = (value) => {
      if (value === undefined || value === this.value[name]) return;
      const next = { ...this.value, [name]: value };
      if (next.from === next.to) return; // a single picture tells nothing
      this.value = next;
      this.changed();
    };
    if (isColor(field)) {
      const swatch = element("input", { type: "color", id, value: hex(this.value[name]) });
      swatch.addEventListener("change", () => take(linear(swatch.value)));
      return { element: element("label", { for: id }, title, swatch) };
    }
    const trouble = (text) => {
      entry.element.title = text;
      entry.element.setAttribute("aria-invalid", "true");
    };
    let given;
    const own = { ...worded(field), soft: { ...field.soft }, initial: undefined, absent: UNSET, required: true };
    const show = () => {
      entry.element.removeAttribute("aria-invalid");
      entry.show(this.value[name]);
    };
    const entry = numberEntry(own, id, {
      input: (value) => {
        given = value;
      },
      commit: () => {
        const { min = -Infinity, max = Infinity } = field;
        if (given < min || given > max) return trouble(`From ${min} to ${max}`);
        take(given);
        show();
      },
      refuse: trouble,
      restore: show,
    });
    show();
    return { element: element("label", { for: id }, title, entry.element) };
  }
}
