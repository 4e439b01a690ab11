// What the hand does, as changes of the state {scene, settings, view, chosen, home}. `chosen` is what the
// pickers show, `home` the scene as it was picked.

import { fetchPreset } from "./api.js";
import { orbit, pan, zoom } from "./camera.js";
import { OWN } from "./library.js";
import { at, put } from "./patch.js";
import { defaults, fields, materialModels, model } from "./schema.js";
import { Store } from "./store.js";

// The material that the eye goes to: that of the first shape which is not flat.
function subject({ shapes, materials }) {
  const shape = shapes.find(({ type }) => type !== "quad") ?? shapes[0];
  return shape?.material ?? Object.keys(materials)[0];
}

const picked = (name, scene) => ({
  scene, home: scene, chosen: { scene: name, environment: OWN, material: subject(scene) },
});

export class Editor extends Store {
  #schema;
  #cameraDefaults;
  #picks = 0;

  // `complain(problem)` shows what was refused, `forgive()` takes it away.
  constructor({ schema, name, scene, complain, forgive }) {
    super({ settings: {}, view: {}, ...picked(name, scene) });
    this.#schema = schema.scene;
    this.complain = complain;
    this.forgive = forgive;
    this.#cameraDefaults = defaults(schema.scene, model(schema.scene, schema.scene, "camera"));
    this.moves = {
      orbit: (right, down) => this.#move(orbit, right, down),
      pan: (right, down) => this.#move(pan, right, down),
      zoom: (factor) => this.#move(zoom, factor),
      rest: () => this.seal(),
    };
  }

  #move(how, ...amounts) {
    const { camera } = this.state.scene;
    this.#setCamera({ ...camera, ...how({ ...this.#cameraDefaults, ...camera }, ...amounts) }, "camera");
  }

  #setCamera(camera, gesture) {
    this.change({ scene: { ...this.state.scene, camera } }, gesture);
  }

  resetView() {
    this.#setCamera(this.state.home.camera, null);
  }

  // A value at a place such as /scene/camera/vfov; undefined gives it back to its default.
  edit(place, value) {
    this.forgive();
    this.change(put(this.state, place, value), place);
  }

  rest() {
    this.seal();
  }

  async #fetch(kind, name, use) {
    const turn = ++this.#picks;
    try {
      const document = await fetchPreset(kind, name);
      if (turn === this.#picks) use(document); // else something else was picked meanwhile
    } catch (problem) {
      this.complain(problem);
      this.amend({}); // the pickers go back to what there is
    }
  }

  pickScene(name) {
    return this.#fetch("scenes", name, (scene) => this.change(picked(name, scene)));
  }

  pickEnvironment(name) {
    const use = (environment) => this.change({
      ...put(this.state, "/scene/environment", environment),
      chosen: { ...this.state.chosen, environment: name },
    });
    if (name === null) use(undefined);
    else if (name === OWN) use(this.state.home.environment);
    else this.#fetch("environments", name, use);
  }

  pickMaterial(material) {
    this.amend({ chosen: { ...this.state.chosen, material } });
  }

  putMaterial(material) {
    const { scene, chosen } = this.state;
    this.change({ scene: { ...scene, materials: { ...scene.materials, [chosen.material]: material } } });
  }

  // Another model for the material: what both know stays, and so does the colour.
  pickModel(type) {
    const models = materialModels(this.#schema);
    const old = this.state.scene.materials[this.state.chosen.material];
    const [before, after] = [old.type, type].map((each) => fields(this.#schema, models[each]));
    const material = { type };
    for (const { name } of after) if (old[name] !== undefined) material[name] = old[name];
    const [from, to] = [before, after].map((all) => all.find(({ widget }) => widget === "color"));
    if (from && to) material[to.name] = old[from.name] ?? from.initial;
    this.putMaterial(material);
  }

  // What was refused goes back to what the server has; `mark(pointer, detail)` shows it at its control and
  // says which place the control is for (null: none has it).
  takeBack({ errors }, valid, mark) {
    const places = errors
      .filter(({ pointer }) => /^\/(scene|settings)(\/|$)/.test(pointer))
      .map(({ pointer, detail }) => mark(pointer, detail));
    if (!valid || !places.length) return;
    const { scene, settings } = valid;
    if (places.includes(null)) this.amend({ scene, settings: this.#own(settings) });
    else this.amend(places.reduce((state, place) => put(state, place, at(valid, place)), this.state));
  }

  #own({ width, height, ...settings }) {
    return settings;
  }
}
