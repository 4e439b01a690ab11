// The panel at the side: forms and pickers made from the server's schema and presets. It shows a state and
// turns what the hand does into edits; it keeps nothing itself.

import { element } from "../lib/dom.js";
import { OWN } from "../document/editor.js";
import { DISPLAY } from "../document/picture-view.js";
import { fillPicker, materialButtons } from "../forms/library.js";
import { MaterialPanel } from "./material-panel.js";
import { Outliner, additions } from "./outliner.js";
import { equal } from "../lib/patch.js";
import { fields, materialModels } from "../server/schema.js";
import { schemaForm } from "../forms/schema-form.js";
import { qualityChoice } from "../forms/quality.js";
import { TextureSlot } from "../forms/texture-slot.js";
import { TextureForm } from "../forms/texturing.js";
import { inWords } from "../lib/format-text.js";

// The settings that stand open; the others are a click away. The picture's size is the window's business.
const MAIN_SETTINGS = ["max_samples", "target_noise", "time_limit", "adaptive", "denoise"];
const NOT_SETTINGS = ["width", "height", "quality"];

const NONE = "(none)";

export class Panel {
  #forms = {};
  #shape = {}; // what the exchangeable forms were made for

  // `acts` is the editor; `stage` has frame(thing), add(offer), duplicate(thing) and takeTexture(place, file). `paint`
  // as materialButtons wants it, `say(text)` reads out; `textureActs(place, field)` as TextureSlot wants them.
  constructor(root, { schema, library, acts, stage, paint, say, textureActs }) {
    this.root = root;
    this.stage = stage;
    this.textureActs = textureActs;
    this.acts = acts;
    this.materials = materialModels(schema.scene);
    this.schema = schema;
    const view = fields(schema.view, schema.view);
    const settings = fields(schema.settings, schema.settings).filter(({ name }) => !NOT_SETTINGS.includes(name));
    this.#forms.view = this.#mount(
      "view",
      view.filter(({ name }) => DISPLAY.includes(name)),
      "/view",
    );
    const main = MAIN_SETTINGS.map((name) => settings.find((field) => field.name === name)).filter(Boolean);
    this.#forms.settings = this.#mount("settings", main, "/settings");
    this.#forms.more = this.#mount(
      "more",
      settings.filter((field) => !main.includes(field)),
      "/settings",
    );
    this.outliner = new Outliner(root, schema, acts, stage);
    this.materialPanel = new MaterialPanel(root, { acts, say });
    this.#qualities = qualityChoice(this.#find("qualities"), (name) => acts.edit("/settings/quality", name));
    this.#pickers(library, paint);
    this.#additions(schema.scene);
  }

  #qualities;

  #find(id) {
    return this.root.querySelector(`#${id}`);
  }

  #pickers(library, paint) {
    const { acts } = this;
    fillPicker(
      this.#find("scene"),
      [{ name: "", title: "Your own" }, ...library.scenes],
      (name) => name && acts.pickScene(name),
    );
    this.#find("scene").options[0].hidden = true;
    const environments = [{ name: OWN, title: "" }, { name: NONE, title: "None (black)" }, ...library.environments];
    fillPicker(this.#find("environment"), environments, (name) => acts.pickEnvironment(name === NONE ? null : name));
    fillPicker(this.#find("material"), [], (name) => acts.pickMaterial(name));
    const models = Object.keys(this.materials).map((name) => ({ name, title: inWords(name) }));
    fillPicker(this.#find("model"), models, (name) => acts.pickModel(name));
    this.presets = materialButtons(this.#find("material-presets"), library.materials, {
      pick: (material) => acts.putMaterial(material),
      fail: acts.complain,
      paint,
    });
  }

  #additions(schema) {
    const add = this.#find("add");
    const offers = additions(schema);
    add.append(...offers.map(({ title }, i) => element("option", { value: String(i) }, title)));
    add.addEventListener("change", () => {
      const offer = offers[Number(add.value)];
      add.value = "";
      this.stage.add(offer);
    });
  }

  // Puts a form for some fields of the place in the document into the panel.
  #mount(id, chosen, place) {
    const textures = [];
    const form = schemaForm(chosen, {
      change: (name, value) => this.#edit(chosen, place, name, value),
      commit: () => this.acts.rest(),
      forgive: () => this.acts.forgive(),
      takeFile: (name, file) => this.stage.takeTexture(`${place}/${name}`, file),
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
    this.#find(`${id}-form`).replaceChildren(form.element);
    return { place, textures, ...form };
  }

  // A choice by which others change is made together with them.
  #edit(chosen, place, name, value) {
    const isLeader =
      value !== undefined && chosen.some(({ ranges, used }) => ranges?.field === name || used?.field === name);
    if (isLeader) this.acts.choose(place, name, value, chosen);
    else this.acts.edit(`${place}/${name}`, value);
  }

  // `knobs`: what the chosen quality makes of the settings that are not given.
  show(state, knobs) {
    const { scene, settings, view, chosen, home } = state;
    this.#find("scene").value = chosen.scene;
    if (this.#find("scene").selectedIndex < 0) this.#find("scene").value = "";
    this.#find("environment").value = chosen.environment ?? NONE;
    this.#find("environment").options[0].text = home.environment ? "The scene's own" : "The scene's own: none";
    this.#showMaterial(scene, chosen);
    this.materialPanel.show(state);
    this.outliner.show(state);
    this.#forms.view.show(view);
    this.#forms.settings.show(settings, knobs);
    this.#forms.more.show(settings, knobs);
  }

  #showMaterial(scene, chosen) {
    const names = Object.keys(scene.materials);
    if (!equal(names, this.#shape.names)) {
      this.#shape.names = names;
      this.#find("material").replaceChildren(
        ...names.map((name) => element("option", { value: name }, inWords(name))),
      );
    }
    this.#find("material").value = chosen.material;
    const { material, materialPlace: place } = this.acts;
    if (!material) return;
    if (this.#shape.material !== material.type + place) {
      this.#shape.material = material.type + place;
      this.#forms.material = this.#mount("material", fields(this.schema.scene, this.materials[material.type]), place);
    }
    this.#find("model").value = material.type;
    this.presets.show(material);
    this.#forms.material.show(material);
  }

  // `live`: the header of the newest frame, from which the presets' prices for this scene follow.
  showQualities(presets, settings, live) {
    this.#qualities(presets, settings.quality ?? this.schema.settings.properties.quality.default, live);
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
    return this.outliner.mark(wrong, text);
  }

  // Whether such words are in sight.
  get isMarkSeen() {
    return [...this.root.querySelectorAll(".trouble:not([hidden])")].some((words) => words.checkVisibility());
  }

  // Takes all such words away.
  forgive() {
    for (const form of this.#places()) form.forgive();
    this.outliner.forgive();
  }
}
