// What the hand does, as changes of the state {scene, settings, view, chosen, home, compare}. `chosen` is what the pickers
// show, `home` the scene as it was picked, `compare` a second variant of one material (variants.js).

import { fetchPreset } from "../server/api.js";
import * as moving from "./camera.js";
import { Conversions, Origins } from "./conversion.js";
import { exposed } from "./lighting.js";
import { isFlat } from "./kinds.js";
import { carried, missingWords, received, unpacked, withTextures, withdrawn } from "./material-set.js";
import { isShape, selectedWith, users, wearing } from "./materials.js";
import { filesFor, modelOfFile } from "./model-files.js";
import { inWords } from "../lib/format-text.js";
import { at, pointer, put } from "../lib/patch.js";
import { blackMaterial, cameraModels, defaults, environmentModels, fields, newMaterial } from "../server/schema.js";
import { Store } from "./store.js";
import * as variants from "./variants.js";
import { without } from "./outline.js";

// The shape that the eye goes to: the first which is not flat.
function subject({ shapes }) {
  const index = shapes.findIndex((shape) => !isFlat(shape));
  return Math.max(index, 0);
}

const picked = (name, scene, exposure) => ({
  scene,
  home: scene,
  compare: null,
  chosen: {
    scene: name,
    environment: OWN,
    thing: pointer("shapes", subject(scene)),
    material: scene.shapes[subject(scene)]?.material ?? Object.keys(scene.materials)[0],
    ...(exposure === undefined ? {} : { exposure }),
  },
});

// The choice of the environment that the scene came with.
export const OWN = "";

export class Editor extends Store {
  #schema;
  #cameraDefaults;
  #picks = 0;
  #turns = 0; // of materials into other models
  #turning = 0; // the number of the one that waits for the server, or 0
  #origins = new Origins();
  #arrival = null; // the material that was put somewhere last, and what was there before
  conversions = new Conversions();
  selection = []; // things that are selected together, as the outline has them

  // `complain(problem)` shows what was refused, `forgive()` takes it away; `waits()` hears that `isWaiting` is true;
  // `askFile({kind, endings})` promises the id of a file that the person picks, or null.
  constructor({ schema, name, scene, complain, forgive, waits, askFile }) {
    super({ settings: {}, view: {}, ...picked(name, scene) });
    this.#schema = schema.scene;
    this.complain = complain;
    this.forgive = forgive;
    this.waits = waits;
    this.askFile = askFile;
    this.plainMaterial = newMaterial(schema.scene);
    this.blackMaterial = blackMaterial(schema.scene);
    const cameras = Object.entries(cameraModels(schema.scene));
    this.#cameraDefaults = Object.fromEntries(cameras.map(([type, own]) => [type, defaults(schema.scene, own)]));
    const move =
      (how) =>
      (...amounts) =>
        this.#setCamera(how(this.camera, ...amounts), "camera");
    this.moves = {
      orbit: move(moving.orbit),
      look: move(moving.look),
      pan: move(moving.pan),
      zoom: move(moving.zoom),
      fly: move(moving.fly),
      turn: (share) => this.#turnEnvironment(share),
      endGesture: () => this.seal(),
    };
  }

  // The camera with what its document leaves out.
  get camera() {
    return this.cameraOf(this.state.scene);
  }

  cameraOf({ camera }) {
    const [usual] = Object.keys(this.#cameraDefaults);
    return { ...this.#cameraDefaults[camera.type ?? usual], ...camera };
  }

  setCamera(members) {
    this.#setCamera(members, null);
  }

  #setCamera(members, gesture) {
    this.change({ scene: { ...this.state.scene, camera: { ...this.state.scene.camera, ...members } } }, gesture);
  }

  // Turns the environment by shares of a whole turn.
  #turnEnvironment(share) {
    const { environment } = this.state.scene;
    if (!environment) return;
    const { min, max } = fields(this.#schema, environmentModels(this.#schema)[environment.type]).find(
      ({ name }) => name === "rotation",
    ).soft;
    const wound = (environment.rotation ?? 0) + share * 360;
    const rotation = wound < min ? wound + 360 : wound > max ? wound - 360 : wound;
    this.change(put(this.state, "/scene/environment/rotation", Number(rotation.toFixed(2))), "turn");
  }

  // From there, by a camera of another type.
  turnCamera(type) {
    this.change({ scene: { ...this.state.scene, camera: moving.turned(this.camera, type) } });
  }

  resetView() {
    this.change({ scene: { ...this.state.scene, camera: this.state.home.camera } });
  }

  // A value at a place such as /scene/camera/vfov; undefined gives it back to its default. Edits of one gesture are
  // undone together.
  edit(place, value, gesture = place) {
    this.forgive();
    this.change(put(this.state, place, value), gesture);
  }

  // A choice of the material at a place with what follows from it; `own` are the fields of its model.
  choose(place, name, value, own) {
    const material = at(this.state, place);
    const isFollowed = own.some(({ ranges }) => ranges?.field === name);
    if (isFollowed) return this.#turn(place, material.type, { choose: { [name]: value } });
    const begun = own
      .filter(
        ({ name: each, used, example }) =>
          example && used?.field === name && used.values.includes(value) && material[each] === undefined,
      )
      .map(({ name: each, example }) => [each, example]);
    this.edit(place, { ...material, [name]: value, ...Object.fromEntries(begun) });
  }

  endGesture() {
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
    return this.#fetch("scenes", name, (scene) => this.openScene(scene, name));
  }

  // `exposure`: the view's that suits the scene's own lights; `members` of the state come with the scene.
  openScene(scene, name, exposure, members = {}) {
    this.change({ ...picked(name, scene, exposure), ...exposed(this.state, exposure), ...members });
  }

  pickEnvironment(name) {
    if (name === null) this.putEnvironment(undefined, name);
    else if (name === OWN) this.putEnvironment(this.state.home.environment, name);
    else this.#fetch("environments", name, (environment) => this.putEnvironment(environment, name));
  }

  // `file`: the name of the one that it came from.
  putEnvironment(environment, name = OWN, file = undefined) {
    this.change({
      ...put(this.state, "/scene/environment", environment),
      chosen: { ...this.state.chosen, environment: name, environmentFile: file },
    });
  }

  // The table of colours through which the picture goes last, by its asset's id, and the name of its file.
  putTable(id, file) {
    const { view, chosen } = this.state;
    const { lut, ...others } = view;
    this.change({ view: id ? { ...others, lut: id } : others, chosen: { ...chosen, tableFile: file } });
  }

  // --- materials ---

  // Where the material in hand is: in the scene, or variant B.
  get materialPlace() {
    const { chosen } = this.state;
    const { compared: compare } = this;
    const isB = compare?.side === "b" && compare.material === chosen.material;
    return isB ? "/compare/document" : pointer("scene", "materials", chosen.material);
  }

  get material() {
    return at(this.state, this.materialPlace);
  }

  pickMaterial(material) {
    this.amend({ chosen: { ...this.state.chosen, material, thing: selectedWith(this.state, material) } });
  }

  // The material in hand, with the textures that it shows.
  get materialSet() {
    const { scene, chosen } = this.state;
    return carried(chosen.material, this.material, scene);
  }

  // Another material in the place of the one in hand, bare or with its textures, under the same name. It comes whole or,
  // if the server refuses any of it, not at all.
  putMaterial(document) {
    const place = this.materialPlace;
    const { material, textures, added, lost } = received(this.state.scene, unpacked(document)[0]);
    this.#arrival = { place, before: this.material, material, added };
    this.change(put({ ...this.state, scene: withTextures(this.state.scene, textures) }, place, material));
    if (lost.length) this.complain(new Error(missingWords(lost)));
  }

  // Things are made of another material of the scene.
  wear(things, material) {
    const { scene, chosen } = this.state;
    const thing = things.includes(chosen.thing) ? chosen.thing : things[0];
    this.change({ scene: wearing(scene, things, material), chosen: { ...chosen, thing, material } });
  }

  // Things get a material from elsewhere, as `dressed` has it; without any it comes in the place of the one in hand.
  async dress(things, what) {
    const { dressed } = await import("./dressing.js");
    const { chosen } = this.state;
    const was = things.length ? undefined : chosen.material;
    const { arrival, lost, material, ...made } = dressed(this.state, things, what, was);
    this.#arrival = arrival;
    const thing = things.find((one) => one === chosen.thing) ?? things[0] ?? selectedWith({ ...made, chosen }, material);
    this.change({ ...made, chosen: { ...chosen, thing, material } });
    if (lost.length) this.complain(new Error(missingWords(lost)));
  }

  // What is selected gets a material from the library, under its name there. In a comparison the variant in hand does, and
  // where nothing is selected that is made of any, all that is made of the one in hand.
  assign(document, wanted) {
    const { scene, chosen } = this.state;
    const isCompared = this.compared?.material === chosen.material;
    if (isCompared && this.compared.side === "b") return this.putMaterial(document);
    const selected = this.selection.includes(chosen.thing) ? this.selection : [chosen.thing];
    const things = isCompared ? [] : selected.filter(isShape);
    const worn = users(scene, chosen.material).map((i) => pointer("shapes", i));
    return this.dress(things.length ? things : worn, { document, wanted });
  }

  pickModel(type) {
    return this.#turn(this.materialPlace, type);
  }

  // Makes the material in hand what a file of this kind says.
  putFile(kind, id) {
    const { type, name } = modelOfFile(this.#schema, kind);
    if (this.material.type === type) this.edit(`${this.materialPlace}/${name}`, id);
    else return this.#turn(this.materialPlace, type, { files: { [name]: id } });
  }

  // Whether a material is being turned into another model.
  get isWaiting() {
    return this.#turning > 0;
  }

  // Turns the material at a place into another model, or gives it other values of its menus with what follows; the
  // result stands at `to`.
  async #turn(place, type, { choose, to = place, files } = {}) {
    const turn = ++this.#turns;
    const old = at(this.state, place);
    if (!old) return this.waits(); // it was deleted meanwhile
    this.#turning = turn;
    this.waits();
    try {
      const known = choose ? undefined : old.type === type ? old : this.#origins.of(place, old, type);
      const asked = known || choose ? {} : (files ?? (await filesFor(this.#schema, type, this.askFile)));
      if (!asked) return this.#stay(turn);
      const made = known ?? (await this.conversions.to(old, type, { ...choose, ...asked }));
      if (turn !== this.#turns) return; // another one was picked meanwhile
      this.#turning = 0;
      const now = at(this.state, place);
      if (now !== old) return this.#turn(place, type, { choose, to, files: asked }); // edited meanwhile
      if (choose) return this.edit(to, made);
      this.#origins.keep(to, old, made);
      this.change(put(this.state, to, made));
    } catch (problem) {
      if (turn === this.#turns) this.complain(problem);
      this.#stay(turn);
    }
  }

  #stay(turn) {
    if (turn !== this.#turns) return;
    this.#turning = 0;
    this.amend({}); // the pickers go back to what there is
  }

  // --- two variants ---

  // What B is and whether it is edited, or null where it is not seen.
  get compared() {
    return variants.comparedB(this.state);
  }

  startComparing() {
    this.change(variants.begun(this.state));
  }

  // A render of the server's at the right of the picture.
  compareWith({ id }) {
    const begun = { ...this.state, ...variants.begun(this.state) };
    const { compare } = variants.placed(begun, "left", "a");
    this.change({ ...begun, ...variants.placed({ compare }, "right", variants.RENDER + id) });
  }

  stopComparing() {
    this.change(variants.ended(this.state));
  }

  discardB() {
    this.change({ compare: null });
  }

  editSide(side) {
    this.amend(variants.sided(this.state, side));
  }

  // Makes B what A would be as another model.
  pickVariant(type) {
    return this.#turn(pointer("scene", "materials", this.state.compare.material), type, { to: "/compare/document" });
  }

  swapVariants() {
    this.change(variants.swapped(this.state));
  }

  // --- things of the scene ---

  // `thing`: /camera, /environment, /lights/0, /shapes/0; a material that no thing is made of, /materials/gold.
  select(thing) {
    const shape = thing.startsWith("/shapes/") ? at(this.state.scene, thing) : null;
    const { chosen } = this.state;
    this.amend({ chosen: { ...chosen, thing, material: shape?.material ?? chosen.material } });
  }

  // `members`: what else of the scene becomes another with it.
  add(kind, document, members = {}) {
    const { chosen } = this.state;
    const scene = { ...this.state.scene, ...members };
    const all = scene[kind] ?? [];
    this.change({
      scene: { ...scene, [kind]: [...all, document] },
      chosen: { ...chosen, thing: pointer(kind, all.length), material: document.material ?? chosen.material },
    });
  }

  // A scene keeps at least one shape.
  removable(thing) {
    return thing.startsWith("/lights/") || (thing.startsWith("/shapes/") && this.state.scene.shapes.length > 1);
  }

  remove(thing) {
    this.change(without(this.state, [thing]));
  }

  // What was refused goes back to what the server has; `mark(pointer, detail)` shows it at its control and
  // says which place the control is for (null: none has it). These places come back. A whole material goes as it came.
  takeBack({ errors }, valid, mark) {
    const arrival = this.#arrival;
    const isArrivals = ({ pointer: wrong }) =>
      [arrival.place, ...arrival.added.map((name) => pointer("scene", "textures", name))].some(
        (place) => wrong === place || wrong.startsWith(`${place}/`),
      );
    if (arrival && at(this.state, arrival.place) === arrival.material && errors.some(isArrivals)) {
      this.#arrival = null;
      this.amend(withdrawn(this.state, arrival));
      return [null];
    }
    const places = errors
      .filter(({ pointer: wrong }) => /^\/(scene|settings)(\/|$)/.test(wrong))
      .map(({ pointer: wrong, detail }) => mark(wrong, detail));
    if (!valid || !places.length) return places;
    const { scene, settings } = valid;
    if (places.includes(null)) this.amend({ scene, settings: this.#own(settings), chosen: this.#chosenIn(scene) });
    else this.amend(places.reduce((state, place) => put(state, place, at(valid, place)), this.state));
    return places;
  }

  // What is chosen, as far as the scene has it.
  #chosenIn(scene) {
    const { chosen } = this.state;
    return chosen.material in scene.materials ? chosen : { ...picked(chosen.scene, scene).chosen };
  }

  // The streams are given sizes of their own, which are not those of the output.
  #own({ width, height, ...settings }) {
    const own = this.state.settings;
    return own.width ? { ...settings, width: own.width, height: own.height } : settings;
  }
}
