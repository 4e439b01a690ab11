// The panel at the side: forms and pickers made from the server's schema and presets. It shows a state and
// turns what the hand does into edits; it keeps nothing itself.

import { element } from "./dom.js";
import { OWN, fillPicker, materialButtons } from "./library.js";
import { equal, pointer } from "./patch.js";
import { environmentModels, fields, materialModels, model } from "./schema.js";
import { schemaForm } from "./schema-form.js";
import { inWords } from "./words.js";

// The settings that stand open; the others are a click away. The picture's size is the window's business.
const MAIN_SETTINGS = ["quality", "max_samples"];
const NOT_SETTINGS = ["width", "height"];

// What of a view is a matter of taste; the rest is how the stream carries it.
export const DISPLAY = ["exposure", "tone_map"];

const NONE = "(none)";

export class Panel {
  #forms = {};
  #shape = {}; // what the exchangeable forms were made for

  // `acts` has edit(place, value), rest(), forgive(), pickScene(name), pickEnvironment(name or null or OWN),
  // pickMaterial(name), pickModel(type), putMaterial(document), complain(problem).
  constructor(root, { schema, library, acts }) {
    this.root = root;
    this.acts = acts;
    this.materials = materialModels(schema.scene);
    this.environments = environmentModels(schema.scene);
    this.schema = schema;
    const view = fields(schema.view, schema.view);
    const settings = fields(schema.settings, schema.settings).filter(({ name }) => !NOT_SETTINGS.includes(name));
    const camera = fields(schema.scene, model(schema.scene, schema.scene, "camera"));
    this.#forms.view = this.#mount("view", view.filter(({ name }) => DISPLAY.includes(name)), "/view");
    const main = MAIN_SETTINGS.map((name) => settings.find((field) => field.name === name));
    this.#forms.settings = this.#mount("settings", main, "/settings");
    const more = settings.filter(({ name }) => !MAIN_SETTINGS.includes(name));
    this.#forms.more = this.#mount("more", more, "/settings");
    this.#forms.camera = this.#mount("camera", camera, "/scene/camera");

    fillPicker(this.#find("scene"), library.scenes, (name) => acts.pickScene(name));
    const environments = [{ name: OWN, title: "" }, { name: NONE, title: "None (black)" }, ...library.environments];
    fillPicker(this.#find("environment"), environments, (name) => acts.pickEnvironment(name === NONE ? null : name));
    fillPicker(this.#find("material"), [], (name) => acts.pickMaterial(name));
    const models = Object.keys(this.materials).map((name) => ({ name, title: inWords(name) }));
    fillPicker(this.#find("model"), models, (name) => acts.pickModel(name));
    const swatches = this.#find("material-presets");
    const put = (material) => acts.putMaterial(material);
    this.presets = materialButtons(swatches, library.materials, put, acts.complain);
  }

  #find(id) { return this.root.querySelector(`#${id}`); }

  // Puts a form for some fields of the place in the document into the panel.
  #mount(id, chosen, place) {
    const form = schemaForm(chosen, {
      change: (name, value) => this.acts.edit(`${place}/${name}`, value),
      commit: () => this.acts.rest(),
      forgive: () => this.acts.forgive(),
    });
    this.#find(`${id}-form`).replaceChildren(form.element);
    return { place, ...form };
  }

  #remount(id, models, type, place) {
    if (this.#shape[id] === type + place) return;
    this.#shape[id] = type + place;
    this.#forms[id] = this.#mount(id, models[type] ? fields(this.schema.scene, models[type]) : [], place);
  }

  // `knobs`: what the chosen quality makes of the settings that are not given.
  show({ scene, settings, view, chosen, home }, knobs) {
    this.#find("scene").value = chosen.scene;
    this.#find("environment").value = chosen.environment ?? NONE;
    this.#find("environment").options[0].text = home.environment ? "The scene's own" : "The scene's own: none";
    const names = Object.keys(scene.materials);
    if (!equal(names, this.#shape.names)) {
      this.#shape.names = names;
      this.#find("material").replaceChildren(...names.map((name) => element("option", { value: name }, inWords(name))));
    }
    this.#find("material").value = chosen.material;
    const material = scene.materials[chosen.material];
    const place = pointer("scene", "materials", chosen.material);
    this.#remount("material", this.materials, material.type, place);
    this.#remount("environment", this.environments, scene.environment?.type ?? "", "/scene/environment");
    this.#find("model").value = material.type;
    this.presets.show(material);
    this.#forms.material.show(material);
    this.#forms.environment.show(scene.environment ?? {});
    this.#forms.camera.show(scene.camera);
    this.#forms.view.show(view);
    this.#forms.settings.show(settings, knobs);
    this.#forms.more.show(settings, knobs);
  }

  // Says at the control for this place what is wrong with it: the control's place, or null where there is none.
  mark(wrong, text) {
    for (const { place, mark } of Object.values(this.#forms)) {
      if (!wrong.startsWith(`${place}/`)) continue;
      const [name] = wrong.slice(place.length + 1).split("/");
      if (mark(name, text)) return `${place}/${name}`;
    }
    return null;
  }

  // Takes all such words away.
  forgive() {
    for (const form of Object.values(this.#forms)) form.forgive();
  }
}
