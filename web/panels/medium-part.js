// What fills the selected body, or all space around: the description of its medium, and a form of its fields.

import { turned, wayOf, WAYS } from "../document/medium.js";
import { schemaForm } from "../forms/schema-form.js";
import { element, freshId } from "../lib/dom.js";
import { at } from "../lib/patch.js";
import { fields, model, property } from "../server/schema.js";

const NAMES = { none: "None", look: "By colour and radius", coefficients: "By coefficients" };

export class MediumPart {
  #made = null; // what the form was made for
  #form = null;

  // `root` is its place on the page; `schema` of the scene; `acts` the editor.
  constructor(root, { schema, acts }) {
    Object.assign(this, { root, schema, acts });
    this.select = element(
      "select",
      { id: freshId("medium"), onchange: ({ target }) => this.#turn(target.value) },
      ...Object.entries(NAMES).map(([value, name]) => element("option", { value }, name)),
    );
    this.head = element("div", { class: "field" }, element("label", { for: this.select.id }, "Medium"), this.select);
    this.note = element("p", { class: "note" });
    this.body = element("div");
    root.append(this.head, this.note, this.body);
  }

  get #place() {
    return `${this.thing}/medium`;
  }

  #turn(way) {
    const { scene } = this.acts.state;
    const shape = this.thing === "/environment" ? null : at(scene, this.thing);
    this.acts.edit(`/scene${this.#place}`, turned(at(scene, this.#place), way, scene, shape));
    this.acts.endGesture();
  }

  // `thing`: what is selected, with its model `owner` of the schema; null where that has no medium.
  show(scene, { thing, owner }) {
    this.thing = thing;
    this.root.hidden = !thing;
    if (!thing) return;
    const medium = at(scene, this.#place);
    const way = wayOf(medium) ?? "none";
    this.select.value = way;
    const kind = `${thing} ${way}`;
    if (kind !== this.#made) this.#make(kind, way, owner);
    this.#form?.show(medium);
  }

  #make(kind, way, owner) {
    this.#made = kind;
    const own = model(this.schema, owner, "medium");
    this.note.textContent = property(this.schema, owner, "medium").description;
    this.note.hidden = way !== "none";
    const others = Object.entries(WAYS).flatMap(([name, names]) => (name === way ? [] : names));
    const chosen = fields(this.schema, own).filter(({ name }) => !others.includes(name));
    this.#form =
      way === "none"
        ? null
        : schemaForm(
            chosen.map((field) => ({ ...field, required: field.required || WAYS[way].includes(field.name) })),
            {
              change: (name, value) => this.acts.edit(`/scene${this.#place}/${name}`, value),
              commit: () => this.acts.endGesture(),
              forgive: () => this.acts.forgive(),
            },
          );
    this.body.replaceChildren(...(this.#form ? [this.#form.element] : []));
  }

  // As Panel.mark: the control's place, or null.
  mark(wrong, text) {
    const place = `/scene${this.#place}`;
    if (!this.thing || !wrong.startsWith(`${place}/`)) return null;
    const [name] = wrong.slice(place.length + 1).split("/");
    return this.#form?.mark(name, text) ? `${place}/${name}` : null;
  }

  forgive() {
    this.#form?.forgive();
  }
}
