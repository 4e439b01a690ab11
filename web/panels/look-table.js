// The table of colours through which the picture goes last, as a photographer's program has it: a .cube file.

import { element } from "../lib/dom.js";
import { accepted, browse } from "../lib/files.js";

export class LookTable {
  // `take(file)` sends a file and puts it in, `remove()` takes it away, `nameOf(id)` is how its file was called.
  constructor({ take, remove, nameOf }) {
    this.nameOf = nameOf;
    const open = async () => {
      const [file] = await browse(accepted(["table"]));
      if (file) await take(file);
    };
    this.name = element("span", { class: "name" });
    this.choose = element(
      "button",
      { type: "button", class: "button small choose", "aria-label": "Choose a colour table", onclick: open },
      "Choose a .cube file…",
    );
    const other = element(
      "button",
      { type: "button", class: "open", title: "Another table", "aria-label": "Another colour table", onclick: open },
      this.name,
    );
    const forget = element(
      "button",
      {
        type: "button",
        class: "forget",
        "aria-label": "Remove the colour table",
        onclick: () => {
          remove();
          this.choose.focus();
        },
      },
      "×",
    );
    this.chip = element("div", { class: "texture", hidden: true }, other, forget);
    const hint = "A look that the picture's colours go through last.";
    this.element = element(
      "div",
      { class: "field", "data-field": "lut", title: hint },
      element("span", { class: "label" }, "Colour table"),
      this.choose,
      this.chip,
    );
  }

  // `id`: the asset's, or undefined.
  show(id) {
    this.choose.hidden = Boolean(id);
    this.chip.hidden = !id;
    this.name.textContent = id ? (this.nameOf(id) ?? "A table of colours") : "";
  }
}
