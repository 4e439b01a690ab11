// Messages over the picture's edge: they take nothing away and wait for nobody. One of each kind at a time.

import { element } from "./dom.js";

export class Messages {
  #shown = new Map();

  // `root` is a live region: what is put in is read out once.
  constructor(root) {
    this.root = root;
  }

  // `action` is {label, does}; a message without `lasting` can be closed by hand.
  show(kind, { title, detail = "", action = null, lasting = false }) {
    this.hide(kind);
    const button = action && element("button", { type: "button", onclick: action.does }, action.label);
    const close = lasting ? null : element("button", {
      type: "button", class: "close", "aria-label": "Close message", onclick: () => this.hide(kind),
    }, "×");
    const text = element("p", {}, element("strong", {}, title), detail ? ` ${detail}` : "");
    const node = element("div", { class: `message ${kind}` }, text, button, close);
    this.#shown.set(kind, node);
    this.root.append(node);
  }

  hide(kind) {
    this.#shown.get(kind)?.remove();
    this.#shown.delete(kind);
  }
}
