// A list of pictures to choose from, as one stop of the Tab key: arrows, Home and End move among the options, a click,
// Enter or Space chooses one.

import { element } from "./dom.js";

const HAS_FINGERS = matchMedia("(any-pointer: coarse)").matches;
const STEPS = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 };

export class PictureList {
  #options = new Map(); // by value: the option with its picture, made once
  #shown = [];
  #chosen = null;

  // `root` is the listbox. `choose(value)`; where `follows` is set, moving chooses. `keys` has what other keys do:
  // {Delete: (value) => ...}; `carry` hears of an option that is dragged away: take(value, dataTransfer), leave(); under a
  // finger, where there is no dataTransfer, move(x, y) and drop(x, y) too.
  constructor(root, { choose, follows = false, keys = {}, carry = null }) {
    Object.assign(this, { root, choose, follows, carry });
    if (carry && HAS_FINGERS) this.#watchFingers();
    root.addEventListener("click", ({ target }) => {
      const option = target.closest("[role=option]");
      if (!option) return;
      this.#stop(option);
      choose(option.dataset.value);
    });
    root.addEventListener("keydown", (event) => {
      const at = this.#shown.indexOf(document.activeElement?.dataset.value);
      if (at < 0 || event.ctrlKey || event.metaKey || event.altKey) return;
      const last = this.#shown.length - 1;
      const to = { Home: 0, End: last }[event.key] ?? at + (STEPS[event.key] ?? 0);
      const value = this.#shown[at];
      if (to !== at && to >= 0 && to <= last) this.#move(this.#shown[to]);
      else if (event.key === "Enter" || event.key === " ") choose(value);
      else if (keys[event.key]) keys[event.key](value);
      else if (!STEPS[event.key] && event.key !== "Home" && event.key !== "End") return;
      event.preventDefault();
      event.stopPropagation(); // the page has other uses for these keys
    });
  }

  async #watchFingers() {
    const { watchPull } = await import("./pull.js");
    watchPull(this.root, (target) => target.closest("[role=option]"), {
      ...this.carry,
      take: ({ dataset }) => this.carry.take(dataset.value, null),
    });
  }

  #move(value) {
    const option = this.#options.get(value).node;
    this.#stop(option);
    option.focus();
    option.scrollIntoView({ block: "nearest", inline: "nearest" });
    if (this.follows) this.choose(value);
  }

  #stop(option) {
    for (const value of this.#shown) {
      const { node } = this.#options.get(value);
      node.tabIndex = node === option ? 0 : -1;
    }
  }

  // `entries`: [{value, title, label, hint, group}]: `title` names the option, `label` is what is written under its
  // picture (the title, unless given); those of a `group` stand together under its name. `paint(image, value)` is called for each new picture.
  fill(entries, paint) {
    const values = entries.map(({ value }) => value);
    const isSame = values.length === this.#shown.length && values.every((each, i) => each === this.#shown[i]);
    for (const { value, title, label = title, hint = title } of entries) {
      const known = this.#options.get(value);
      if (known) {
        known.node.setAttribute("aria-label", title);
        known.node.title = hint;
        known.name.textContent = label;
        continue;
      }
      const image = element("img", { class: "thumb", alt: title, draggable: "false" });
      const name = element("span", {}, label);
      const node = element(
        "div",
        { role: "option", class: "picture", "data-value": value, "aria-label": title, title: hint, tabindex: "-1" },
        image,
        name,
      );
      if (this.carry) this.#offer(node, value);
      this.#options.set(value, { node, image, name });
      paint?.(image, value);
    }
    if (isSame) return;
    const focused = this.#shown.includes(document.activeElement?.dataset.value) ? document.activeElement : null;
    for (const value of this.#options.keys())
      if (!values.includes(value) && this.follows) this.#options.delete(value);
    this.#shown = values;
    const groups = new Map();
    for (const { value, group = "" } of entries) {
      if (!groups.has(group)) groups.set(group, []);
      groups.get(group).push(this.#options.get(value).node);
    }
    this.root.replaceChildren(
      ...[...groups].flatMap(([group, nodes]) =>
        group ? element("div", { role: "group", class: "pictures", "aria-label": group }, ...nodes) : nodes,
      ),
    );
    this.mark(this.#chosen);
    if (focused?.isConnected) focused.focus();
  }

  #offer(node, value) {
    node.draggable = true;
    node.addEventListener("dragstart", ({ dataTransfer }) => {
      dataTransfer.effectAllowed = "copy";
      this.carry.take(value, dataTransfer);
    });
    node.addEventListener("dragend", () => this.carry.leave());
  }

  // The one that the Tab key stops at, or null.
  get current() {
    return this.#shown.find((value) => this.#options.get(value).node.tabIndex === 0) ?? null;
  }

  image(value) {
    return this.#options.get(value)?.image ?? null;
  }

  // Marks the one that is chosen; null for none.
  mark(chosen) {
    const isOther = chosen !== this.#chosen;
    this.#chosen = chosen;
    let stop = null;
    for (const value of this.#shown) {
      const { node } = this.#options.get(value);
      node.setAttribute("aria-selected", String(value === chosen));
      if (value === chosen || node === document.activeElement) stop = node;
    }
    stop ??= this.#options.get(this.#shown[0])?.node;
    if (stop) this.#stop(stop);
    if (isOther && chosen !== null && stop?.checkVisibility()) reveal(this.root, stop);
  }
}

const MARGIN = 8; // CSS pixels between an option in sight and the end of its row

// Brings an option into its row's sight without moving the page.
function reveal(row, option) {
  const [outer, inner] = [row.getBoundingClientRect(), option.getBoundingClientRect()];
  const [before, behind] = [inner.left - outer.left - MARGIN, inner.right - outer.right + MARGIN];
  if (before < 0) row.scrollLeft += before;
  else if (behind > 0) row.scrollLeft += behind;
}
