// What can be turned about an image in a parameter's place: how the parameter reads it, and how the image lies.
// The first belongs to the parameter, the second to the texture, which other parameters may share.

import { element } from "../lib/dom.js";
import { at, pointer } from "../lib/patch.js";
import { fields, textureModel } from "../server/schema.js";
import { schemaForm } from "./schema-form.js";
import { users } from "../document/textures.js";
import { inWords } from "../lib/format-text.js";

// For the parameter at `place` in the editor's state.
export class TextureForm {
  #made = null;
  #ramp = null;
  #own = []; // the forms of the parameter and of its texture

  constructor(field, { schema, place, acts }) {
    Object.assign(this, { field, schema, place, acts });
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
      this.#own = [
        this.#part(this.field.reference, this.place),
        this.#part(textureModel(this.schema, texture), pointer("scene", "textures", value.texture)),
      ];
      this.#ramp = null;
      this.body.replaceChildren(...this.#own.map((part) => part.element));
      if (texture.type === "ramp") this.#addRamp(value.texture);
    }
    for (const part of [...this.#own, this.#ramp]) part?.show(at(this.acts.state, part.place) ?? {});
    const count = users(scene, value.texture);
    this.shared.hidden = count < 2;
    this.shared.textContent = `This changes all ${count} parameters that use ${value.texture}.`;
  }

  // The forms that are shown now, each with its place, those inside of others first.
  get parts() {
    return [...(this.#ramp?.parts ?? []), ...this.#own];
  }

  // What a ramp reads, and its stops: a form of its own, loaded for the first ramp.
  async #addRamp(name) {
    const own = this.#own;
    const { RampForm } = await import("./ramp-form.js");
    if (own !== this.#own) return;
    const place = pointer("scene", "textures", name);
    const form = new RampForm({
      schema: this.schema,
      place,
      acts: this.acts,
      part: (model, at) => this.#part(model, at),
    });
    this.#ramp = form;
    this.body.append(form.element);
    form.show(at(this.acts.state, place) ?? {});
  }

  // A form for the members of a model but for `input`, which the form of a ramp has.
  #part(model, place) {
    const own = fields(this.schema, model).filter(({ name }) => name !== "input");
    const form = schemaForm(own, {
      change: (name, value) => {
        const { uv, ...lying } = at(this.acts.state, place) ?? {};
        // Only texture coordinates come in sets.
        const isProjected = name === "mapping" && (value ?? "uv") !== "uv" && uv !== undefined;
        if (isProjected) this.acts.edit(place, { ...lying, mapping: value }, `${place}/mapping`);
        else this.acts.edit(`${place}/${name}`, value);
      },
      commit: () => this.acts.endGesture(),
      forgive: () => this.acts.forgive(),
    });
    return { place, ...form };
  }
}
