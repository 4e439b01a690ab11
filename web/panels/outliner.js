// What the scene contains, as a list to pick from, and what can be added to it.

import { additions } from "../document/additions.js";
import { things } from "../document/things.js";
import { element } from "../lib/dom.js";
import { icon } from "../lib/icon.js";
import { equal } from "../lib/patch.js";

export class Outliner {
  #shown = null;

  // `find(id)` elements; `schema` of the scene; `acts` the editor; `add(offer)` as in additions.js.
  constructor(find, { schema, acts, add }) {
    this.acts = acts;
    this.list = find("outline-list");
    this.list.addEventListener("click", ({ target }) => {
      const row = target.closest("[data-thing]");
      if (row) acts.select(row.dataset.thing);
    });
    this.list.addEventListener("keydown", (event) => this.#walk(event));
    const offers = additions(schema);
    const choice = find("add");
    choice.append(...offers.map(({ title }, i) => element("option", { value: String(i) }, title)));
    choice.addEventListener("change", () => {
      const offer = offers[Number(choice.value)];
      choice.value = "";
      add(offer);
    });
  }

  #walk(event) {
    const all = this.#shown.map(({ thing }) => thing);
    const now = all.indexOf(this.thing);
    const to = { ArrowDown: now + 1, ArrowUp: now - 1, Home: 0, End: all.length - 1 }[event.key];
    if (to === undefined) return;
    this.acts.select(all[Math.min(Math.max(to, 0), all.length - 1)]);
    event.preventDefault();
  }

  show({ scene, chosen }) {
    const list = things(scene);
    this.thing = chosen.thing;
    if (!equal(list, this.#shown)) {
      this.#shown = list;
      this.list.replaceChildren(
        ...list.map((each) =>
          element(
            "li",
            {
              role: "option",
              title: each.title,
              "data-thing": each.thing,
              id: `thing${each.thing.replaceAll("/", "-")}`,
            },
            icon(each.icon),
            element("span", {}, each.title),
            element("span", { class: "dim" }, each.note),
          ),
        ),
      );
    }
    for (const row of this.list.children) {
      const isIt = row.dataset.thing === this.thing;
      if (isIt && row.getAttribute("aria-selected") !== "true") row.scrollIntoView({ block: "nearest" });
      row.setAttribute("aria-selected", String(isIt));
    }
    this.list.setAttribute("aria-activedescendant", `thing${this.thing.replaceAll("/", "-")}`);
  }
}
