// The buttons around the list of the scene's materials, and the line that says what is made of the one in hand.

import { pictured } from "../document/material-set.js";
import * as materials from "../document/materials.js";
import { things } from "../document/things.js";
import { watchMenu } from "../lib/menu.js";
import { pointer } from "../lib/patch.js";
import { watchToolbar } from "../lib/tabs.js";
import { sentence } from "../lib/format-text.js";

const MOST_NAMED = 2; // things that are named; more are counted

// `find(id)` elements, `acts` the editor, `say(text)` reads out, `paint(image, set, isWorn)` puts in its
// picture.
export class MaterialPanel {
  #painted = []; // what its picture was made of
  #isWorn = false; // what it was then

  constructor(find, { acts, say, paint }) {
    Object.assign(this, { find, acts, say, paint });
    const clicks = {
      "new-material": () => this.#add((state) => materials.added(state, "material", acts.plainMaterial)),
      "duplicate-material": () => this.#copy(),
      "own-material": () => this.#copy(),
      "rename-material": () => this.rename(this.#name),
      "delete-material": () => this.remove(this.#name),
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
    this.say(`${this.#name}: ${this.#users()}`);
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
            detail: count === 1 ? "One thing is made of it." : `${count} things are made of it.`,
            label: count === 1 ? "It gets" : "They get",
            options: others.map((value) => ({ value, title: value })),
            action: "Delete",
          });
    if (instead !== null) this.acts.change(materials.removed(this.acts.state, name, instead));
  }

  // What is made of the material in hand.
  #users() {
    const { scene } = this.acts.state;
    const found = materials.users(scene, this.#name);
    if (!found.length) return "nothing is made of it yet";
    if (found.length > MOST_NAMED) return `${found.length} things are made of it`;
    const titles = new Map(things(scene).map(({ thing, title }) => [thing, title]));
    return `${found.map((i) => titles.get(pointer("shapes", i))).join(" and ")} ${found.length > 1 ? "are" : "is"} made of it`;
  }

  show({ scene, chosen }) {
    this.find("material-name").textContent = this.#name;
    this.find("material-users").textContent = `${sentence(this.#users())}.`;
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
