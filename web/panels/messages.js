// Messages at the foot of the panel, where they cover nothing: one of each kind at a time, and each goes when what it
// is about has gone.

import { element } from "../lib/dom.js";

export class Messages {
  #shown = new Map();

  // `root` is a live region: what is put in is read out once. `about(kind)` lists the values that messages of this
  // kind are about: when one of them is another, `review` takes the message away.
  constructor(root, about) {
    this.root = root;
    this.about = about;
  }

  // `action` is {label, does}; a message without `lasting` can be closed by hand; `list` are lines under it.
  // `below` is an element under it. With `progress` it shows a bar, and what is returned sets it, 0..1.
  show(kind, { title, detail = "", list = [], below = null, action = null, lasting = false, progress = false }) {
    this.hide(kind);
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
    const text = element("div", {}, element("strong", {}, title), detail ? ` ${detail}` : "");
    if (list.length) text.append(element("ul", {}, ...list.map((line) => element("li", {}, line))));
    if (below) text.append(below);
    const bar = progress ? element("progress", { max: "1", value: "0", "aria-label": title }) : null;
    const node = element("div", { class: `message ${kind}` }, text, bar, button, close);
    this.#shown.set(kind, { node, about: lasting ? [] : this.about(kind) });
    this.root.append(node);
    // The message takes its height from the page above it: the field in hand stays in sight.
    document.activeElement?.closest?.(".page .field")?.scrollIntoView({ block: "nearest" });
    return (share) => {
      if (bar) bar.value = share;
    };
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
