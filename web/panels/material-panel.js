// The buttons around the list of the scene's materials, what the one in hand is on, and the button that puts it on the
// selected thing where that is made of another one.

import { pictured } from "../document/material-set.js";
import * as materials from "../document/materials.js";
import { things } from "../document/things.js";
import { watchMenu } from "../lib/menu.js";
import { at, pointer } from "../lib/patch.js";
import { watchToolbar } from "../lib/tabs.js";

const MOST_NAMED = 2; // things that are named; of more, one is

// `find(id)` elements, `acts` the editor, `say(text)` reads out, `paint(image, set, isWorn)` puts in its
// picture.
export class MaterialPanel {
  #painted = []; // what its picture was made of
  #isWorn = false; // what it was then

  constructor(find, { acts, say, paint }) {
    Object.assign(this, { find, acts, say, paint });
    const clicks = {
      "new-material": () => this.#add((state) => materials.added(state, "Material", acts.plainMaterial)),
      "duplicate-material": () => this.#copy(),
      "own-material": () => this.#copy(),
      "rename-material": () => this.rename(this.#name),
      "delete-material": () => this.remove(this.#name),
      "put-on": () => acts.wear([acts.state.chosen.thing], this.#name),
    };
    for (const [id, does] of Object.entries(clicks)) find(id).addEventListener("click", does);
    find("material-name").addEventListener("dblclick", ({ target }) => this.rename(this.#name, target));
    watchToolbar(find("material-acts"));
    watchToolbar(find("material-tools"));
    watchMenu(find("material-more"), find("material-menu"));
  }

  get #name() {
    return this.acts.state.chosen.material;
  }

  #add(make) {
    this.acts.change(make(this.acts.state));
    this.say(`${this.#name}: ${this.#worn().words}`);
  }

  #copy() {
    this.#add((state) => materials.copied(state, this.acts.material));
  }

  // Where its name stands on the shelf, else in the inspector.
  async rename(from, at = this.#tile(from) ?? this.find("material-name")) {
    const { nameInPlace } = await import("../lib/name-entry.js");
    const to = await nameInPlace(at, {
      label: `Name of ${from}`,
      value: from,
      problem: (name) => materials.problem(this.acts.state.scene, from, name),
    });
    if (to !== null && to !== from) this.acts.change(materials.renamed(this.acts.state, from, to));
    this.#tile(to ?? from)
      ?.closest("[role=option]")
      .focus();
  }

  #tile(name) {
    const found = this.find("materials").querySelector(`[data-value="${CSS.escape(name)}"] > span`);
    found?.scrollIntoView({ block: "nearest", inline: "nearest" });
    return found?.checkVisibility() ? found : null;
  }

  async remove(name) {
    const { askWhich } = await import("../lib/ask.js");
    const { scene } = this.acts.state;
    if (Object.keys(scene.materials).length < 2) return;
    const others = Object.keys(scene.materials).filter((each) => each !== name);
    const count = materials.users(scene, name).length;
    const instead =
      count === 0
        ? others[0]
        : await askWhich({
            title: `Delete ${name}?`,
            detail: count === 1 ? "It is on one thing." : `It is on ${count} things.`,
            label: "Replace it by",
            options: others.map((value) => ({ value, title: value })),
            action: "Delete",
          });
    if (instead !== null) this.acts.change(materials.removed(this.acts.state, name, instead));
  }

  // What the material in hand is on, the selected thing first: {words, all}.
  #worn() {
    const { scene, chosen } = this.acts.state;
    const titles = new Map(things(scene).map(({ thing, title }) => [thing, title]));
    const worn = materials.users(scene, this.#name).map((i) => pointer("shapes", i));
    const isSelected = worn.includes(chosen.thing);
    const ordered = isSelected ? [chosen.thing, ...worn.filter((thing) => thing !== chosen.thing)] : worn;
    const [first, ...rest] = ordered.map((thing) => titles.get(thing));
    if (first === undefined) return { words: "On nothing yet", all: "" };
    const others = rest.length < MOST_NAMED ? rest : [`${rest.length} more`];
    return { words: `On ${[first, ...others].join(" and ")}`, all: [first, ...rest].join(", ") };
  }

  show({ scene, chosen }) {
    this.find("material-name").textContent = this.#name;
    const { words, all } = this.#worn();
    this.find("material-users").textContent = words;
    this.find("material-users").title = all;
    const isOther = materials.isShape(chosen.thing) && at(scene, chosen.thing).material !== this.#name;
    this.find("put-on").hidden = !isOther;
    if (isOther) {
      const { title } = things(scene).find(({ thing }) => thing === chosen.thing);
      this.find("put-on").textContent = `Put on ${title}`;
    }
    this.find("own-material").hidden = !materials.isShared({ scene }, chosen.thing);
    this.find("delete-material").disabled = Object.keys(scene.materials).length < 2;
    const now = pictured(this.acts.material, scene, this.#painted);
    const isWorn = materials.isWorn(scene, chosen.material);
    if (now === this.#painted && isWorn === this.#isWorn) return;
    this.#painted = now;
    this.#isWorn = isWorn;
    this.paint(this.find("material-picture"), this.acts.materialSet, isWorn);
  }
}
