// Messages at the foot of the stage. The newest is to be seen, and goes after a while, or when what it is about has
// gone; one that lasts is to be seen again after it.

import { element } from "../lib/dom.js";

const BRIEF_MS = 6000; // that a message stays by itself
const AGAIN_MS = 1000; // until the next look at one that a hand was on

export class Messages {
  #shown = new Map();

  // `root` is a live region: what is put in is read out once. `about(kind)` lists the values that messages of this
  // kind are about: when one of them is another, `review` takes the message away.
  constructor(root, about, brief_ms = BRIEF_MS) {
    Object.assign(this, { root, about, brief_ms });
  }

  // `action` is {label, does}; a message without `lasting` can be closed by hand; `list` are lines that are read on
  // demand, unless there is one only. `below` is an element under it, with which the message stays, as a refusal does:
  // it is read, or copied from. With `progress` it shows a bar, and what is returned sets it, 0..1.
  show(kind, { title, detail = "", list = [], below = null, action = null, lasting = false, progress = false }) {
    this.hide(kind);
    for (const [other, { isLasting }] of this.#shown) if (!isLasting) this.hide(other);
    const button = action && element("button", { type: "button", onclick: action.does }, action.label);
    const close = lasting
      ? null
      : element(
          "button",
          {
            type: "button",
            class: "close",
            "aria-label": "Close message",
            onclick: () => this.hide(kind),
          },
          "×",
        );
    const words = [detail, ...(list.length === 1 ? list : [])].filter(Boolean).join(" ");
    const text = element("div", {}, element("strong", {}, title), words && ` ${words}`);
    if (list.length > 1) {
      const lines = element("ul", {}, ...list.map((line) => element("li", {}, line)));
      text.append(" ", element("details", {}, element("summary", {}, "Details"), lines));
    }
    if (below) text.append(below);
    const bar = progress ? element("progress", { max: "1", value: "0", "aria-label": title }) : null;
    const node = element("div", { class: `message ${kind}` }, text, bar, button, close);
    this.#shown.set(kind, { node, isLasting: lasting, about: lasting ? [] : this.about(kind) });
    this.root.prepend(node);
    if (!lasting && !below && kind !== "refusal") this.#leave(kind, node, this.brief_ms);
    return (share) => {
      if (bar) bar.value = share;
    };
  }

  // Takes a message away in a while: later where somebody reads it.
  #leave(kind, node, wait_ms) {
    setTimeout(() => {
      if (this.#shown.get(kind)?.node !== node) return;
      const isRead = document.hidden || node.matches(":hover, :focus-within, :has(details[open])");
      if (isRead) this.#leave(kind, node, AGAIN_MS);
      else this.hide(kind);
    }, wait_ms);
  }

  hide(kind) {
    this.#shown.get(kind)?.node.remove();
    this.#shown.delete(kind);
  }

  // Call when anything has changed.
  review() {
    for (const [kind, { about }] of this.#shown) {
      const now = this.about(kind);
      if (about.some((each, i) => each !== now[i])) this.hide(kind);
    }
  }
}

// Says short things to a screen reader: the newest one, and not while they still change.
export class Announcer {
  #timer = null;

  constructor(root) {
    this.root = root;
  }

  say(text) {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => {
      this.root.textContent = text;
    }, 400);
  }
}
