// The buttons around the list of the scene's materials, and the line that says what is made of the one in hand.

import { askName, askWhich } from "../lib/ask.js";
import * as materials from "../document/materials.js";
import { things } from "../document/things.js";
import { pointer } from "../lib/patch.js";
import { inWords, sentence } from "../lib/format-text.js";

const MOST_NAMED = 2; // things that are named; more are counted

// `acts` is the editor, `say(text)` reads out.
export class MaterialPanel {
  constructor(root, { acts, say }) {
    Object.assign(this, { root, acts, say });
    const clicks = {
      "new-material": () => this.#add((state) => materials.added(state, "material", acts.plainMaterial)),
      "duplicate-material": () => this.#copy(),
      "own-material": () => this.#copy(),
      "rename-material": () => this.#rename(),
      "delete-material": () => this.#remove(),
    };
    for (const [id, does] of Object.entries(clicks)) this.#find(id).addEventListener("click", does);
  }

  #find(id) {
    return this.root.querySelector(`#${id}`);
  }

  get #name() {
    return this.acts.state.chosen.material;
  }

  #add(make) {
    this.acts.change(make(this.acts.state));
    this.say(`${inWords(this.#name)}: ${this.#users()}`);
  }

  #copy() {
    this.#add((state) => materials.copied(state, this.acts.material));
  }

  async #rename() {
    const from = this.#name;
    const to = await askName({
      title: "Rename the material",
      label: "Name",
      value: from,
      action: "Rename",
      problem: (name) => materials.problem(this.acts.state.scene, from, name),
    });
    if (to !== null && to !== from) this.acts.change(materials.renamed(this.acts.state, from, to));
  }

  async #remove() {
    const name = this.#name;
    const { scene } = this.acts.state;
    const others = Object.keys(scene.materials).filter((each) => each !== name);
    const count = materials.users(scene, name).length;
    const instead =
      count === 0
        ? others[0]
        : await askWhich({
            title: `Delete ${inWords(name)}?`,
            detail: count === 1 ? "One thing is made of it." : `${count} things are made of it.`,
            label: count === 1 ? "It gets" : "They get",
            options: others.map((value) => ({ value, title: inWords(value) })),
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
    this.#find("material-users").textContent = `${sentence(this.#users())}.`;
    const isShared = materials.isShared({ scene }, chosen.thing);
    this.#find("own-material").hidden = !isShared;
    this.#find("delete-material").disabled = Object.keys(scene.materials).length < 2;
  }
}
