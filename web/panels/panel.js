// The inspector: forms made from the server's schema, of what is selected and of the render. It shows a state and turns
// what the hand does into edits; it keeps nothing itself.

import { DISPLAY } from "../document/picture-view.js";
import { paired } from "../document/materials.js";
import { showEditing } from "./editing.js";
import { fillPicker } from "../forms/library.js";
import { MaterialPanel } from "./material-panel.js";
import { ThingPart } from "./thing-part.js";
import { fields, materialModels } from "../server/schema.js";
import { schemaForm } from "../forms/schema-form.js";
import { TextureSlot } from "../forms/texture-slot.js";
import { TextureForm } from "../forms/texturing.js";
import { inWords } from "../lib/format-text.js";
import { OnDemand } from "../lib/on-demand.js";

// The settings that stand open; the others are a click away. The picture's size has a form of its own.
const MAIN_SETTINGS = ["max_samples", "target_noise", "time_limit", "adaptive", "denoise"];
const NOT_SETTINGS = ["width", "height"];

export class Panel {
  #forms = {};
  #made = null; // what the material's form was made for

  // `find(id)` elements; `acts` is the editor; `stage` has frame(thing), duplicate(thing), takeTexture(place, file),
  // takeTable(file) and replaceFile({kind, endings});
  // `paint(image, material, isWorn)` puts in a picture, `say(text)` reads out; `textureActs(place, field)` as TextureSlot wants
  // them.
  constructor(find, { schema, library, acts, stage, paint, say, textureActs }) {
    Object.assign(this, { find, stage, textureActs, acts, schema });
    this.root = find("panel");
    this.materials = materialModels(schema.scene);
    const view = fields(schema.view, schema.view);
    const settings = fields(schema.settings, schema.settings).filter(({ name }) => !NOT_SETTINGS.includes(name));
    this.#forms.view = this.#mount(
      "view",
      view.filter(({ name }) => DISPLAY.includes(name)),
      "/view",
    );
    this.table = new OnDemand(
      () => import("./look-table.js"),
      ({ LookTable }) =>
        new LookTable({
          take: this.stage.takeTable,
          remove: () => acts.putTable(),
          nameOf: () => acts.state.chosen.tableFile,
        }),
      {
        complain: acts.complain,
        arrived: (table) => {
          find("view-form").append(table.element);
          table.show(acts.state.view.lut);
        },
      },
    );
    const main = MAIN_SETTINGS.map((name) => settings.find((field) => field.name === name)).filter(Boolean);
    this.#forms.settings = this.#mount("settings", main, "/settings");
    this.#forms.more = this.#mount(
      "more",
      settings.filter((field) => !main.includes(field)),
      "/settings",
    );
    this.thingPart = new ThingPart(find, { schema: schema.scene, acts, stage, environments: library.environments });
    this.materialPanel = new MaterialPanel(find, { acts, say, paint });
    const models = Object.keys(this.materials).map((name) => ({ name, title: inWords(name) }));
    fillPicker(find("model"), models, (name) => acts.pickModel(name));
    find("filter").addEventListener("input", () => this.#forms.material.filter(find("filter").value));
  }

  // Puts a form for some fields of the place in the document into the panel.
  #mount(id, chosen, place) {
    const textures = [];
    const form = schemaForm(chosen, {
      change: (name, value) => this.#edit(chosen, place, name, value),
      commit: () => this.acts.endGesture(),
      forgive: () => this.acts.forgive(),
      takeFile: (name, file) => this.stage.takeTexture(`${place}/${name}`, file),
      pickFile: ({ file }) => this.stage.replaceFile(file),
      slot: (field, remove) =>
        new TextureSlot(field, { ...this.textureActs(`${place}/${field.name}`, field), remove }),
      beneath: (field) => {
        const made = new TextureForm(field, {
          schema: this.schema.scene,
          place: `${place}/${field.name}`,
          acts: this.acts,
        });
        textures.push(made);
        return made;
      },
    });
    this.find(`${id}-form`).replaceChildren(form.element);
    return { place, textures, ...form };
  }

  // A choice by which others change is made together with them.
  #edit(chosen, place, name, value) {
    const isLeader =
      value !== undefined && chosen.some(({ ranges, used }) => ranges?.field === name || used?.field === name);
    const { beside } = chosen.find((field) => field.name === name);
    const partner = chosen.find((field) => field.name === beside);
    if (partner) this.acts.edit(place, paired(this.acts.material, name, value, partner), `${place}/${name}`);
    else if (isLeader) this.acts.choose(place, name, value, chosen);
    else this.acts.edit(`${place}/${name}`, value);
  }

  // `knobs`: what the chosen quality makes of the settings that are not given.
  show(state, knobs) {
    const { settings, view } = state;
    this.#showMaterial();
    showEditing(this.find, state);
    this.materialPanel.show(state);
    this.thingPart.show(state);
    this.#forms.view.show(view);
    if (!this.find("film-part").hidden) this.table.get().catch(this.table.complain);
    this.table.now?.show(view.lut);
    this.#forms.settings.show(settings, knobs);
    this.#forms.more.show(settings, knobs);
  }

  #showMaterial() {
    const { material, materialPlace: place } = this.acts;
    if (!material) return;
    if (this.#made !== material.type + place) {
      this.#made = material.type + place;
      this.find("filter").value = "";
      this.#forms.material = this.#mount("material", fields(this.schema.scene, this.materials[material.type]), place);
    }
    this.find("model").value = material.type;
    this.#forms.material.show(material);
  }

  // The forms with their places, those inside of others first.
  #places() {
    const forms = Object.values(this.#forms);
    return [...forms.flatMap(({ textures }) => textures.flatMap(({ parts }) => parts)), ...forms];
  }

  // Says at the control for this place what is wrong with it: the control's place, or null where there is none.
  mark(wrong, text) {
    for (const { place, mark } of this.#places()) {
      if (!wrong.startsWith(`${place}/`)) continue;
      const [name] = wrong.slice(place.length + 1).split("/");
      if (mark(name, text)) return `${place}/${name}`;
    }
    return this.thingPart.mark(wrong, text);
  }

  // Whether such words are in sight.
  get isMarkSeen() {
    return [...this.root.querySelectorAll(".trouble:not([hidden])")].some((words) => words.checkVisibility());
  }

  // Takes all such words away.
  forgive() {
    for (const form of this.#places()) form.forgive();
    this.thingPart.forgive();
  }
}
