// What the scene contains, as a tree to pick from, and what can be added to it.

import { additions } from "../document/additions.js";
import { watchOffers } from "../lib/offers.js";
import { isNameable, isOn, named, rows, toggled, whyItStays, without } from "../document/outline.js";
import { at } from "../lib/patch.js";
import { element } from "../lib/dom.js";
import { icon } from "../lib/icon.js";
import { equal } from "../lib/patch.js";

const idOf = ({ id }) => `thing${id.replaceAll(/[^\w-]/g, (letter) => `-${letter.codePointAt(0).toString(36)}`)}`;
const FLAGS = { hidden: ["Hide", "Show", "H"], locked: ["Lock", "Unlock", "L"] };

export class Outliner {
  #rows = null;
  #folded = new Set(); // groups, by their paths
  #selected = new Set(); // things: what is chosen, and others with it
  #active = null; // the id of the row that keys act on
  #state = null;

  // `find(id)` elements; `schema` of the scene; `acts` the editor; `add(offer)` as in additions.js; `say(text)`.
  constructor(find, { schema, acts, add, say }) {
    Object.assign(this, { acts, say });
    this.list = find("outline-list");
    this.list.addEventListener("click", (event) => this.#click(event));
    this.list.addEventListener("dblclick", ({ target }) => {
      const row = this.#rowAt(target);
      if (row && !target.closest("button")) this.rename(row);
    });
    this.list.addEventListener("keydown", (event) => this.#key(event));
    this.several = find("outline-several");
    const offers = additions(schema);
    const choice = find("add");
    choice.append(...offers.map(({ title }, i) => element("option", { value: String(i) }, title)));
    watchOffers(choice, (value) => add(offers[Number(value)]));
  }

  #rowAt(target) {
    const node = target.closest("[role=treeitem]");
    return node && this.#rows.find((row) => idOf(row) === node.id);
  }

  // The rows whose groups are all open.
  get #open() {
    const shut = [...this.#folded].map((group) => `${group}/`);
    const path = ({ group, members }) => group ?? at(this.#state.scene, members[0])?.name ?? "";
    return this.#rows.filter((row) => !shut.some((each) => path(row).startsWith(each)));
  }

  #click(event) {
    const row = this.#rowAt(event.target);
    if (!row) return;
    const button = event.target.closest("button");
    if (button) {
      event.stopPropagation(); // the outline stays open
      if (button.dataset.flag) this.#toggle(button.dataset.flag, row);
      else this.#fold(row, !this.#folded.has(row.group));
    } else if (event.shiftKey) this.#reach(row);
    else if (event.ctrlKey || event.metaKey) this.#add(row);
    else this.#pick(row);
  }

  #pick(row) {
    this.#active = row.id;
    this.#selected = new Set(row.members);
    this.acts.select(row.members[0]);
  }

  // Takes a row to the selection, or from it.
  #add(row) {
    this.#active = row.id;
    const isIn = row.members.every((thing) => this.#selected.has(thing));
    for (const thing of row.members) this.#selected[isIn ? "delete" : "add"](thing);
    const [first = "/camera"] = isIn ? this.#selected : row.members;
    if (!this.#selected.size) this.#selected.add(first);
    this.acts.select(first);
  }

  // Selects from what is chosen to a row.
  #reach(row) {
    const open = this.#open;
    const ends = [open.findIndex(({ thing }) => thing === this.#state.chosen.thing), open.indexOf(row)];
    const [from, to] = [Math.max(0, Math.min(...ends)), Math.max(...ends)];
    this.#active = row.id;
    this.#selected = new Set([this.#state.chosen.thing, ...open.slice(from, to + 1).flatMap((each) => each.members)]);
    this.acts.select(this.#state.chosen.thing);
  }

  #fold(row, isShut) {
    this.#folded[isShut ? "add" : "delete"](row.group);
    this.#active = row.id;
    this.show(this.#state);
  }

  // All that is selected where the row is part of that.
  #with(row) {
    return row.members.every((thing) => this.#selected.has(thing)) ? [...this.#selected] : row.members;
  }

  #toggle(flag, row) {
    const all = this.#with(row).filter((thing) => thing !== "/camera");
    if (!all.length || (flag === "locked" && all.includes("/environment"))) return;
    this.acts.change(toggled(this.#state, flag, all));
    this.say(`${row.title}: ${isOn(this.#state, flag, all) ? flag : { hidden: "shown", locked: "free" }[flag]}`);
  }

  #key(event) {
    if (event.altKey || event.target.closest("input")) return;
    const open = this.#open;
    const now = Math.max(
      0,
      open.findIndex(({ id }) => id === this.#active),
    );
    const row = open[now];
    const to = { ArrowDown: now + 1, ArrowUp: now - 1, Home: 0, End: open.length - 1 }[event.key];
    const isMany = event.ctrlKey || event.metaKey;
    if (to !== undefined) {
      const next = open[Math.min(Math.max(to, 0), open.length - 1)];
      if (event.shiftKey) this.#reach(next);
      else if (isMany) {
        this.#active = next.id;
        this.show(this.#state);
      } else this.#pick(next);
    } else if (event.key === "ArrowRight" && row.group !== null && this.#folded.has(row.group))
      this.#fold(row, false);
    else if (event.key === "ArrowRight" && row.group !== null) this.#pick(open[now + 1]);
    else if (event.key === "ArrowLeft" && row.group !== null && !this.#folded.has(row.group)) this.#fold(row, true);
    else if (event.key === "ArrowLeft") {
      const above = open.slice(0, now).findLast(({ level }) => level < row.level);
      if (above) this.#pick(above);
    } else if (event.key === " ") this.#add(row);
    else if (event.key === "Enter") this.#pick(row);
    else if (event.key === "F2") this.rename(row);
    else if (event.key === "Delete") this.#delete();
    else if (event.key.toLowerCase() === "h" && !isMany) this.#toggle("hidden", row);
    else if (event.key.toLowerCase() === "l" && !isMany) this.#toggle("locked", row);
    else if (!event.key.startsWith("Arrow")) return;
    event.preventDefault();
    event.stopPropagation(); // the page has other uses for these keys
  }

  // A field in the place of the row's title.
  rename(row) {
    if (!isNameable(row)) return;
    const node = document.getElementById(idOf(row));
    const entry = element("input", { class: "entry", value: row.title, "aria-label": "Name", maxlength: "80" });
    let isDone = false;
    const end = (isKept) => {
      if (isDone) return;
      isDone = true;
      const name = entry.value.trim();
      this.#rows = null; // the row comes back
      if (isKept && name !== row.title) this.acts.change(named(this.#state, row, name));
      else this.show(this.#state);
      this.list.focus();
    };
    entry.addEventListener("keydown", (event) => {
      event.stopPropagation();
      if (event.key === "Enter" || event.key === "Escape") end(event.key === "Enter");
    });
    entry.addEventListener("blur", () => end(true));
    node.querySelector(".title").replaceWith(entry);
    entry.focus();
    entry.select();
  }

  #delete() {
    const gone = [...this.#selected].filter((thing) => this.acts.removable(thing));
    const shapes = gone.filter((thing) => thing.startsWith("/shapes/")).length;
    if (!gone.length || shapes === this.#state.scene.shapes.length) {
      const [first] = gone.length ? gone : this.#selected;
      return this.acts.complain(new Error(whyItStays(first)));
    }
    this.acts.change(without(this.#state, gone));
    this.say(`${gone.length === 1 ? "One thing" : `${gone.length} things`} deleted`);
  }

  show(state) {
    const { scene, chosen } = state;
    this.#state = state;
    if (!this.#selected.has(chosen.thing)) {
      this.#selected = new Set([chosen.thing]);
      this.#active = chosen.thing;
    }
    this.acts.selection = [...this.#selected];
    const made = rows(scene);
    if (!equal(made, this.#rows)) {
      this.#rows = made;
      this.list.replaceChildren(...made.map((row) => this.#node(row)));
    }
    const open = new Set(this.#open);
    for (const row of this.#rows) {
      const node = document.getElementById(idOf(row));
      const isIt = row.members.every((thing) => this.#selected.has(thing));
      node.hidden = !open.has(row);
      if (row.group !== null) node.setAttribute("aria-expanded", String(!this.#folded.has(row.group)));
      if (isIt && node.getAttribute("aria-selected") !== "true") node.scrollIntoView({ block: "nearest" });
      node.setAttribute("aria-selected", String(isIt));
      node.classList.toggle("active", row.id === this.#active);
      for (const flag of ["hidden", "locked"]) this.#mark(node, row, flag);
    }
    const active = this.#rows.find(({ id }) => id === this.#active);
    if (active) this.list.setAttribute("aria-activedescendant", idOf(active));
    this.#showSeveral(scene);
  }

  #mark(node, row, flag) {
    const isOnNow = isOn(this.#state, flag, row.members);
    node.classList.toggle(flag, isOnNow);
    const button = node.querySelector(`[data-flag=${flag}]`);
    if (!button || button.dataset.on === String(isOnNow)) return;
    button.dataset.on = String(isOnNow);
    const [does, undoes, key] = FLAGS[flag];
    button.setAttribute("aria-label", `${isOnNow ? undoes : does} ${row.title}`);
    button.title = `${isOnNow ? undoes : does} (${key})`;
    button.replaceChildren(icon({ hidden: ["shown", "hidden"], locked: ["free", "locked"] }[flag][Number(isOnNow)]));
  }

  #node(row) {
    const { title, level, note, group, thing } = row;
    const button = (attributes, ...children) =>
      element("button", { type: "button", tabindex: "-1", class: "flag", ...attributes }, ...children);
    const flags = thing === "/camera" ? [] : thing === "/environment" ? ["hidden"] : ["hidden", "locked"];
    const node = element(
      "li",
      {
        role: "treeitem",
        title: isNameable(row) ? `${title} (F2 renames)` : title,
        id: idOf(row),
        "aria-level": String(level),
        "aria-label": title,
        ...(thing ? { "data-thing": thing } : { "data-group": group }),
      },
      group === null ? null : button({ class: "fold-group", "aria-label": `Fold or open ${title}` }),
      icon(row.icon),
      element("span", { class: "title" }, title),
      element("span", { class: "dim" }, note),
      ...flags.map((flag) => button({ "data-flag": flag })),
    );
    node.style.setProperty("--level", String(level - 1));
    return node;
  }

  // What can be done with several things that are selected.
  #showSeveral(scene) {
    const shapes = [...this.#selected].filter((thing) => thing.startsWith("/shapes/"));
    this.several.hidden = this.#selected.size < 2;
    if (this.several.hidden) return;
    const assign = element(
      "select",
      {
        "aria-label": "Material of all that is selected",
        onchange: ({ target }) => this.acts.wear(shapes, target.value),
      },
      element("option", { value: "", disabled: true, selected: true }, "Material…"),
      ...Object.keys(scene.materials).map((name) => element("option", { value: name }, name)),
    );
    this.several.replaceChildren(
      element("span", { class: "note" }, `${this.#selected.size} selected`),
      shapes.length ? assign : "",
      element("button", { type: "button", class: "button small", onclick: () => this.#delete() }, "Delete"),
    );
  }
}
