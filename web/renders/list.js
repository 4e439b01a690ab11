// The list of renders, on the shelf and in the inspector's sheet: each with its picture, how far it is, and what can be
// done with it.

import { element, freshId } from "../lib/dom.js";
import { icon } from "../lib/icon.js";
import { watchMenu } from "../lib/menu.js";
import { watchToolbar } from "../lib/tabs.js";
import { FORMATS } from "./files.js";
import { hasPicture, isEnded } from "./renders.js";
import { factsOf, stateOf, titleOf } from "./words.js";

const setText = (node, text) => {
  if (node.textContent !== text) node.textContent = text;
};

// The further things that can be done with a render: [{label, does, disabled, leaves}]; what
// leaves the list shows something elsewhere. `acts` as RenderList has them.
export function furtherActs(acts, render) {
  const disabled = !hasPicture(render);
  return [
    ...acts.formats().map((format) => ({
      label: FORMATS[format].title,
      does: () => acts.save(render, format),
      disabled,
    })),
    ...(acts.compareWith
      ? [{ label: "Compare with the picture", does: () => acts.compareWith(render), disabled, leaves: true }]
      : []),
    { label: "Edit its scene", does: () => acts.reopen(render), disabled: false, leaves: true },
  ];
}

// One render. What it says is renewed by `show`; the nodes stay, so that the focus does.
class Item {
  constructor(id, acts) {
    this.acts = acts;
    const button = (label, attributes, ...children) =>
      element("button", { type: "button", "aria-label": label, title: label, ...attributes }, ...children);
    const small = "button small";
    this.image = element("img", { class: "thumb", alt: "" });
    this.name = element("b", {});
    this.state = element("span", { class: "state" });
    this.facts = element("span", { class: "note facts" });
    this.making = element("span", { class: "note making" });
    this.bar = element("progress", { max: "1", value: "0" });
    this.png = button("Download PNG", { class: small, onclick: () => acts.save(this.render, "png") }, "PNG");
    this.exr = button("Download EXR", { class: small, onclick: () => acts.save(this.render, "exr") }, "EXR");
    const menuId = freshId("render-menu");
    const menu = element("div", { id: menuId, class: "menu", popover: "auto", role: "menu", "aria-label": "More" });
    const more = button(
      "More for this render",
      { class: "button icon", popovertarget: menuId, "aria-haspopup": "menu" },
      icon("more"),
    );
    watchMenu(more, menu, { opened: () => this.#fill(menu) });
    this.stop = button("Stop", { class: "button icon", onclick: () => acts.stop(this.render) }, icon("stop"));
    this.remove = button("Delete", { class: "button icon", onclick: () => acts.remove(this.render) }, icon("remove"));
    this.tools = element(
      "div",
      { class: "render-parts", role: "toolbar" },
      button("Open", { class: "shot", onclick: () => acts.open(this.render) }, this.image),
      element("div", { class: "render-text" }, this.name, this.state, this.facts, this.making),
      element("div", { class: "render-acts" }, this.png, this.exr, more, this.stop, this.remove),
    );
    watchToolbar(this.tools);
    this.element = element("li", { class: "render", "data-id": id }, this.tools, this.bar, menu);
  }

  #fill(menu) {
    menu.replaceChildren(
      ...furtherActs(this.acts, this.render).map(({ label, does, disabled }) =>
        element("button", { type: "button", role: "menuitem", disabled, onclick: does }, label),
      ),
    );
  }

  show(render) {
    this.render = render;
    const { acts } = this;
    const title = titleOf(render);
    this.element.setAttribute("aria-label", title);
    this.element.dataset.state = render.state;
    this.tools.setAttribute("aria-label", title);
    this.bar.setAttribute("aria-label", `Progress of ${title}`);
    setText(this.name, title);
    this.name.title = title;
    setText(this.state, stateOf(render, acts.left(render)));
    this.state.title = [...render.warnings, stateOf(render, acts.left(render))].join("\n");
    setText(this.facts, factsOf(render).join(" · "));
    setText(this.making, acts.making(render.id).join(". "));
    if (this.bar.value !== render.advance.share) this.bar.value = render.advance.share;
    for (const [format, each] of [
      ["png", this.png],
      ["exr", this.exr],
    ]) {
      each.setAttribute("aria-busy", String(acts.isMaking(render.id, format)));
      each.disabled = !hasPicture(render);
    }
    if (isEnded(render) && document.activeElement === this.stop) this.remove.focus();
    this.stop.hidden = isEnded(render);
  }
}

export class RenderList {
  #items = new Map();
  #sight;

  // `acts`: open(render), save(render, format), stop(render), remove(render), reopen(render), compareWith(render) or
  // null, more(); formats() beside PNG and EXR; left(render), making(id), isMaking(id, format); paint(image, render).
  constructor(root, acts) {
    Object.assign(this, { root, acts });
    this.list = element("ul", { class: "renders", role: "list", "aria-label": "Renders" });
    this.empty = element("p", { class: "note" }, "Finished pictures are listed here, and renders under way.");
    this.older = element(
      "button",
      { type: "button", class: "button small", hidden: true, onclick: () => acts.more() },
      "Show older",
    );
    root.append(this.empty, this.list, this.older);
    this.#sight = new IntersectionObserver((seen) => {
      for (const { target, isIntersecting } of seen) {
        const item = this.#items.get(target.dataset.id);
        if (!item) continue;
        item.isSeen = isIntersecting;
        this.#paint(item);
      }
    });
  }

  get isShown() {
    return this.root.checkVisibility();
  }

  #paint(item) {
    if (item.isSeen) this.acts.paint(item.image, item.render);
  }

  show({ entries, hasMore }) {
    for (const render of entries) {
      let item = this.#items.get(render.id);
      if (!item) {
        item = new Item(render.id, this.acts);
        this.#items.set(render.id, item);
        this.#sight.observe(item.element);
      }
      item.show(render);
      this.#paint(item);
    }
    const ids = entries.map(({ id }) => id);
    for (const [id, item] of this.#items) if (!ids.includes(id)) this.#drop(id, item);
    const nodes = ids.map((id) => this.#items.get(id).element);
    nodes.forEach((node, i) => {
      if (this.list.children[i] !== node) this.list.insertBefore(node, this.list.children[i] ?? null);
    });
    this.empty.hidden = nodes.length > 0;
    this.older.hidden = !hasMore;
  }

  // The focus goes to the neighbour.
  #drop(id, { element: node }) {
    const heir = node.nextElementSibling ?? node.previousElementSibling;
    const hadFocus = node.contains(document.activeElement);
    this.#sight.unobserve(node);
    node.remove();
    this.#items.delete(id);
    if (hadFocus) heir?.querySelector("button")?.focus();
  }
}
