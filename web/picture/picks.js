// What a click in the picture is about, and what the camera is brought to: selecting, focusing, framing.

import { ball, box, learn, together } from "../document/bounds.js";
import { isFlat } from "../document/kinds.js";
import { axes, eye, ray } from "../document/camera.js";
import { isOn } from "../document/outline.js";
import { Picker, isThere } from "../document/picking.js";
import { inWords } from "../lib/format-text.js";
import { at, equal, pointer } from "../lib/patch.js";
import { describeAsset } from "../server/api.js";
import { dot } from "../lib/vector.js";

const BRIEF_MS = 1000; // that a new thing waits to learn from the picture what is in its way
const DOUBLE_MS = 400; // after a click in which another one is a part of it, and does not go on to what is behind
const LENS_SHARE = 0.02; // of the distance: what a pinhole opens to when somebody wants to focus

// Whether shapes are those that there were, be they of another material.
const areInPlace = (shapes, before = []) =>
  shapes === before ||
  (shapes.length === before.length &&
    shapes.every(
      (shape, i) => shape === before[i] || equal({ ...shape, material: "" }, { ...before[i], material: "" }),
    ));

export class Picks {
  #outlined = {}; // what the outline was drawn of: it stays while that is so
  #before = null; // the same, while a hand points at shapes
  #clicked = null; // where the last click was, what there was then, and the thing that it took

  // `find(id)` elements, `acts` the editor, `stream`, `viewport`; `say(text)`, `complain(error)`.
  constructor({ find, acts, stream, viewport, say, complain }) {
    Object.assign(this, { find, acts, viewport, say, complain });
    this.picker = new Picker(stream);
  }

  // The outline goes with what it was drawn of.
  mark() {
    const { scene, chosen } = this.acts.state;
    const { camera, shapes, thing } = this.#outlined;
    if (scene.camera !== camera || chosen.thing !== thing || !areInPlace(scene.shapes, shapes))
      this.find("outline").classList.remove("shown");
  }

  // The index of the shape at a point of the page, or null.
  async shapeAt(x, y) {
    const place = this.viewport.place(x, y);
    return place && this.picker.shape(this.acts.state.scene, place);
  }

  // Has shapeAt() answer at once.
  prepare() {
    return this.picker.layer("shape_id", this.acts.state.scene).catch(() => {});
  }

  async select(place) {
    const { scene } = this.acts.state;
    const before = this.#clicked; // now: a click that has not been answered yet is not gone through
    const shape = await this.picker.shape(scene, place);
    if (shape === null || !scene.shapes[shape]) {
      this.acts.select("/environment");
      return this.say("Environment selected");
    }
    const isAgain = before && this.#isAgain(before, place, scene);
    const chosen = isAgain ? await this.#behind(place, scene, shape, Number(before.thing.split("/")[2])) : shape;
    if (isOn(this.acts.state, "locked", [pointer("shapes", chosen)])) return this.say("It is locked");
    this.acts.select(pointer("shapes", chosen));
    const { camera, shapes } = scene;
    this.#clicked = { place, camera, shapes, thing: pointer("shapes", chosen), when: performance.now() };
    this.say(`${inWords(scene.shapes[chosen].material)} selected`);
    if (chosen === shape) await this.#outline(scene, shape);
    else this.find("outline").classList.remove("shown"); // what lies behind has no edge in the picture
  }

  // Whether a click is at the same place as the one before, of which the selection is.
  #isAgain({ place: last, camera, shapes, thing, when }, place, scene) {
    const { width, height } = this.viewport.canvas;
    return (
      performance.now() - when > DOUBLE_MS &&
      isThere(last, place, width / height) &&
      camera === scene.camera &&
      areInPlace(scene.shapes, shapes) &&
      thing === this.acts.state.chosen.thing
    );
  }

  // What lies behind the shape `last`, where `seen` is what the picture shows.
  async #behind(place, scene, seen, last) {
    const { behind } = await import("../document/through.js");
    await this.boxes(); // so that meshes have some
    const { camera } = this.acts;
    const { width, height } = this.viewport.canvas;
    const [from, way] = [eye, ray].map((part) => part(camera, place.x, place.y, width / height));
    const isLocked = (i) => isOn(this.acts.state, "locked", [pointer("shapes", i)]);
    return behind(scene.shapes, from, way, seen, last, isLocked);
  }

  async #outline(scene, shape) {
    const [{ drawContour }, layer] = await Promise.all([
      import("../document/contour.js"),
      this.picker.layer("shape_id", scene),
    ]);
    drawContour(
      this.find("outline"),
      layer,
      shape,
      getComputedStyle(this.find("stage")).getPropertyValue("--accent-bright"),
    );
    const { camera, shapes } = scene;
    this.#outlined = { camera, shapes, thing: this.acts.state.chosen.thing, shape };
    this.find("outline").classList.add("shown");
    this.mark();
  }

  // Outlines the shape that a hand is over; for null the one that was outlined before, if any.
  async point(shape) {
    const isShown = this.find("outline").classList.contains("shown");
    if (shape !== null) this.#before ??= isShown ? this.#outlined : {};
    const outlined = shape ?? this.#before?.shape ?? null;
    if (shape === null) this.#before = null;
    if (outlined === null) this.find("outline").classList.remove("shown");
    else await this.#outline(this.acts.state.scene, outlined);
  }

  async focus(place, aspect) {
    const { camera } = this.acts;
    if (camera.aperture_radius === undefined) return this.say("Only a camera in perspective has a focus");
    const far = await this.picker.depth(this.acts.state.scene, place);
    if (!(far > 0)) return this.say("Nothing there to focus on");
    const along = far * dot(ray(camera, place.x, place.y, aspect), axes(camera).forward);
    const lens = camera.aperture_radius > 0 ? {} : { aperture_radius: Number((along * LENS_SHARE).toPrecision(2)) };
    this.acts.setCamera({ focus_distance: Number(along.toPrecision(4)), ...lens });
    this.say(`Focus at ${along.toPrecision(3)} metres${lens.aperture_radius ? ", aperture opened" : ""}`);
  }

  // The box around each shape of the scene: what the document or its file tells, else what is seen of it, else null.
  async boxes() {
    const { scene } = this.acts.state;
    await Promise.race([learn(scene.shapes, describeAsset), new Promise((resolve) => setTimeout(resolve, BRIEF_MS))]);
    const known = scene.shapes.map(box);
    if (known.every(Boolean)) return known;
    const seen = await this.picker.boxes(scene, this.acts.camera, BRIEF_MS).catch(() => new Map());
    return known.map((each, i) => each ?? seen.get(i) ?? null);
  }

  // Brings a thing into the middle; without one, everything that is not endless. `framed(around)` as the controller has.
  async frame(thing, framed) {
    const { scene } = this.acts.state;
    const shape = thing.startsWith("/shapes/") ? at(scene, thing) : null;
    try {
      const around = shape
        ? (ball(shape) ?? (await this.picker.ball(scene, this.acts.camera, Number(thing.split("/")[2]))))
        : together(
            scene.shapes
              .filter((each) => !isFlat(each))
              .map(ball)
              .filter(Boolean),
          );
      if (around?.radius > 0) this.acts.setCamera(framed(around));
      else this.say("It can't be seen from here");
    } catch (error) {
      this.complain(error);
    }
  }
}
