// What can be turned about an image in a parameter's place: how the parameter reads it, and how the image lies.
// The first belongs to the parameter, the second to the texture, which other parameters may share.

import { element } from "../lib/dom.js";
import { at, pointer } from "../lib/patch.js";
import { fields, textureModel } from "../server/schema.js";
import { schemaForm } from "./schema-form.js";
import { users } from "../document/textures.js";
import { inWords } from "../lib/format-text.js";

// For the parameter at `place` in the editor's state. `parts` are the forms shown now, each with its place.
export class TextureForm {
  #made = null;

  constructor(field, { schema, place, acts }) {
    Object.assign(this, { field, schema, place, acts, parts: [] });
    this.kind = element("span", {});
    this.body = element("div", {});
    this.shared = element("p", { class: "dim" });
    this.element = element(
      "details",
      { class: "more beneath", hidden: true },
      element("summary", {}, this.kind, " ", element("span", { class: "unseen" }, `of ${field.title}`)),
      this.body,
      this.shared,
    );
  }

  // A parameter's value; all but references to textures hide this form.
  show(value) {
    const { scene } = this.acts.state;
    const texture = scene.textures?.[value?.texture];
    this.element.hidden = !texture;
    if (!texture) return;
    this.kind.textContent = texture.type ? inWords(texture.type) : "Image";
    const made = JSON.stringify([value.texture, texture.type]);
    if (made !== this.#made) {
      this.#made = made;
      this.parts = [
        this.#part(this.field.reference, this.place),
        this.#part(textureModel(this.schema, texture), pointer("scene", "textures", value.texture)),
      ];
      this.body.replaceChildren(...this.parts.map((part) => part.element));
      if (texture.type === "ramp") this.#ramp(value.texture);
    }
    for (const part of this.parts) part.show(at(this.acts.state, part.place) ?? {});
    const count = users(scene, value.texture);
    this.shared.hidden = count < 2;
    this.shared.textContent = `How it lies holds for all ${count} parameters that show ${value.texture}.`;
  }

  // What a ramp reads, and its stops: a form of its own, loaded for the first ramp.
  async #ramp(name) {
    const { parts } = this;
    const { RampForm } = await import("./ramp-form.js");
    if (parts !== this.parts) return;
    const place = pointer("scene", "textures", name);
    const form = new RampForm({
      schema: this.schema,
      place,
      acts: this.acts,
      part: (model, at) => this.#part(model, at),
    });
    parts.push(form);
    this.body.append(form.element);
    form.show(at(this.acts.state, place) ?? {});
  }

  // A form for the members of a model but for `input`, which the form of a ramp has.
  #part(model, place) {
    const own = fields(this.schema, model).filter(({ name }) => name !== "input");
    const form = schemaForm(own, {
      change: (name, value) => this.acts.edit(`${place}/${name}`, value),
      commit: () => this.acts.rest(),
      forgive: () => this.acts.forgive(),
    });
    return { place, ...form };
  }
}
