// Handles over the picture by which a hand moves, turns and scales what is selected: red along X, green along Y, blue
// along Z. The arrow keys do the same by steps.

import { isOn } from "../document/outline.js";
import { ownBox, see } from "../document/bounds.js";
import { axes } from "../document/camera.js";
import { groundUnder } from "../document/ground.js";
import { isLight } from "../document/kinds.js";
import { growing, mapped, ownAxes, shifted, stretching, turning, wrapped } from "../document/manipulation.js";
import { middle, union } from "../document/placing.js";
import { HANDLED } from "../document/ui-state.js";
import { watchDrags } from "../lib/drag.js";
import { at, pointer, put } from "../lib/patch.js";
import { add, scale, subtract } from "../lib/vector.js";
import { NAMES, WORLD, metresPerPixel, moving, rotating, scaling } from "./handle-drags.js";
import { drawHandles } from "./handle-shapes.js";

const SNAP_PX = 8; // from the ground, within which a thing that is moved is set down on it
const TURN = 15; // degrees: the steps of a turn with Ctrl
const STEP = { move: 0.01, rotate: 1, scale: 0.01 }; // of the size; degrees; of the scale
const STILL = 2; // CSS pixels that a hand may slip before it drags

const short = (x) => String(Number(x.toPrecision(3)) + 0);

// Of the world's horizontal axes the one that a direction is nearest to.
function nearest(direction) {
  const k = Math.abs(direction[0]) >= Math.abs(direction[2]) ? 0 : 2;
  return scale(WORLD[k], Math.sign(direction[k]) || 1);
}

export class Handles {
  #asked = null; // the shape that is being measured in the picture
  #dragged = null; // the name of the handle in the hand
  #words = "";

  // `root` is an SVG over the picture; `acts` the editor; `tool()` the one in the hand; `cloud(index)` resolves to the
  // points that can be seen of a shape, or null; `say(text)`.
  constructor(root, { acts, tool, cloud, say }) {
    Object.assign(this, { root, acts, tool, cloud, say });
    watchDrags(root, (event) => this.#begin(event));
  }

  get #thing() {
    return this.acts.state.chosen.thing;
  }

  get #document() {
    return at(this.acts.state.scene, this.#thing);
  }

  // What is changed together: the selection, and shapes and lights that are selected with it and not locked.
  get #things() {
    const own = this.#thing;
    const isIts = (thing) => /^\/(shapes|lights)\//.test(thing);
    const { selection } = this.acts;
    if (!isIts(own) || !selection.includes(own)) return [own];
    const free = (thing) => thing !== own && isIts(thing) && !isOn(this.acts.state, "locked", [thing]);
    return [own, ...selection.filter((thing) => free(thing) && at(this.acts.state.scene, thing))];
  }

  get #isEnvironment() {
    return this.#thing === "/environment";
  }

  // Whether the tool in the hand can change what is selected.
  get isActive() {
    const document = this.#document;
    const tool = this.tool();
    if (!HANDLED.includes(tool) || !document || isOn(this.acts.state, "locked", [this.#thing])) return false;
    if (this.#isEnvironment) return tool === "rotate";
    if (this.#thing.startsWith("/shapes/") || this.#things.length > 1) return true;
    if (!this.#thing.startsWith("/lights/")) return false;
    return { move: Boolean(document.position), rotate: Boolean(document.direction), scale: false }[tool];
  }

  // {low, high} of the selected shape, or of all that is selected, or null: of a light alone, and while it is not known.
  #box() {
    const things = this.#things;
    if (things.length === 1) return this.#thing.startsWith("/shapes/") ? ownBox(this.#document) : null;
    const point = ({ position }) => (position ? { low: position, high: position } : null);
    const boxes = things
      .map((thing) => at(this.acts.state.scene, thing))
      .map((each) => (isLight(each) ? point : ownBox)(each));
    return union(boxes.filter(Boolean));
  }

  // The point about which the selection turns, or null while that is not known.
  #pivot() {
    const box = this.#box();
    if (box) return middle(box);
    return this.#thing.startsWith("/shapes/") ? null : (this.#document.position ?? this.acts.camera.target);
  }

  // Puts the handles where the selection is; `aspect` and `height`, in CSS pixels, are those of the picture.
  show(isOn, aspect, height) {
    Object.assign(this, { isOn, aspect, height });
    const isShown = isOn && this.isActive;
    const pivot = isShown ? this.#pivot() : null;
    this.root.toggleAttribute("hidden", !pivot);
    if (isShown && !pivot) this.#measure();
    if (!pivot) return;
    drawHandles(this.root, {
      mode: this.tool(),
      view: this.#view,
      pivot,
      axes: this.#axes,
      only: this.#isEnvironment ? "Y" : null,
      dragged: this.#dragged,
      words: this.#words,
    });
  }

  #refresh() {
    this.show(this.isOn, this.aspect, this.height);
  }

  get #view() {
    return { camera: this.acts.camera, aspect: this.aspect, height: this.height };
  }

  get #axes() {
    return this.tool() === "scale" && this.#things.length === 1 ? ownAxes(this.#document) : WORLD;
  }

  // A file of triangles that was not uploaded here is measured in the picture.
  async #measure() {
    const document = this.#document;
    if (this.#asked === document) return;
    this.#asked = document;
    const cloud = await this.cloud(Number(this.#thing.split("/")[2])).catch(() => null);
    if (this.#asked === document) this.#asked = null;
    if (!cloud) return;
    see(document, cloud);
    this.#refresh();
  }

  // Takes all that is selected into the scene as `change` makes it of what it was in `before`; the changes of one gesture
  // are one step of undo.
  #put(before, change, gesture) {
    const changed = (thing) => change(at(before, thing));
    if (this.#isEnvironment) {
      this.acts.edit("/scene/environment/rotation", changed(this.#thing).rotation, gesture);
      return;
    }
    this.acts.forgive();
    const next = this.#things.reduce((state, thing) => put(state, `/scene${thing}`, changed(thing)), this.acts.state);
    this.acts.change({ scene: next.scene }, gesture);
  }

  #turned(document, axis, degrees, pivot) {
    if (!this.#isEnvironment) return mapped(document, turning(axis, degrees), pivot);
    return { ...document, rotation: wrapped((document.rotation ?? 0) + degrees * axis[1]) };
  }

  // --- the hand ---

  #begin(event) {
    const handle = event.target.closest("[data-handle]")?.dataset.handle;
    const pivot = this.isActive ? this.#pivot() : null;
    if (!handle || event.altKey || !pivot) return null;
    const tool = this.tool();
    const from = this.#place(event);
    const before = this.acts.state.scene;
    const follow = { move: this.#moving, rotate: this.#rotating, scale: this.#scaling }[tool].call(
      this,
      handle,
      pivot,
      from,
    );
    const gesture = `${tool} ${this.#thing}`;
    const isStill = ({ clientX, clientY }) => Math.hypot(clientX - event.clientX, clientY - event.clientY) < STILL;
    let isMoved = false;
    this.#dragged = handle;
    return {
      move: (now) => {
        isMoved ||= !isStill(now);
        if (!isMoved) return;
        const { change, words } = follow(this.#place(now), now.ctrlKey || now.metaKey);
        this.#words = words;
        this.#put(before, change, gesture);
      },
      end: (isCancelled) => {
        if (isCancelled && isMoved) this.#put(before, (document) => document, gesture);
        else if (isMoved) this.say(this.#words);
        this.#dragged = null;
        this.#words = "";
        this.acts.endGesture();
        this.#refresh();
      },
    };
  }

  // Where in the picture a hand is, 0..1.
  #place({ clientX, clientY }) {
    const { left, top, width, height } = this.root.getBoundingClientRect();
    return { x: (clientX - left) / width, y: (clientY - top) / height };
  }

  #moving(handle, pivot, from) {
    const before = this.#box();
    const follow = moving(this.#view, pivot, handle, from);
    const isLevel = ["X", "Z", "plane Y"].includes(handle);
    // No finer than a pixel: a hand has no more digits.
    const fine = 10 ** Math.floor(Math.log10(metresPerPixel(this.#view, pivot)));
    return (place, isFree) => {
      const offset = follow(place).map((x) => Number((Math.round(x / fine) * fine).toPrecision(12)));
      const drop = isFree || isLevel ? null : this.#drop(before, offset);
      const isNear = drop !== null && Math.abs(drop) < SNAP_PX * metresPerPixel(this.#view, pivot);
      const by = isNear ? add(offset, [0, drop, 0]) : offset;
      const parts = NAMES.map((name, k) => [name, by[k]]).filter(([, far]) => Math.abs(far) > 1e-9);
      const words = parts.map(([name, far]) => `${name} ${far > 0 ? "+" : ""}${short(far)}`).join("  ");
      return { change: (document) => shifted(document, by), words: isNear ? `${words}  on the ground` : words };
    };
  }

  #rotating(handle, pivot, from) {
    const { position } = this.acts.camera;
    const away = subtract(position, pivot);
    const axis = WORLD[NAMES.indexOf(handle)] ?? scale(away, 1 / Math.hypot(...away));
    const follow = rotating(this.#view, pivot, axis, from);
    return (place, isStepped) => {
      const degrees = follow(place);
      const by = isStepped ? TURN * Math.round(degrees / TURN) : Number(degrees.toFixed(1));
      return { change: (document) => this.#turned(document, axis, by, pivot), words: `${short(by)}°` };
    };
  }

  #scaling(handle, pivot, from) {
    const axis = this.#axes[NAMES.indexOf(handle)];
    const follow = scaling(this.#view, pivot, axis, from);
    return (place) => {
      const factor = Number(follow(place).toPrecision(3));
      const map = axis ? stretching(axis, factor) : growing(factor);
      return {
        change: (document) => mapped(document, map, pivot),
        words: `${axis ? `${handle} ` : ""}× ${short(factor)}`,
      };
    };
  }

  // How far what has this box has to rise, from an offset, to stand on the ground; null where there is none.
  #drop(own, offset = [0, 0, 0]) {
    if (!own) return null;
    const things = this.#things;
    const others = this.acts.state.scene.shapes.filter((_, i) => !things.includes(pointer("shapes", i))).map(ownBox);
    const box = { low: add(own.low, offset), high: add(own.high, offset) };
    const ground = groundUnder(box, others.filter(Boolean));
    return ground === null ? null : ground - box.low[1];
  }

  // Sets what is selected down on what is under it.
  land() {
    const drop = this.#drop(this.#box());
    if (drop === null) return this.say("There is no ground under it");
    this.#put(this.acts.state.scene, (document) => shifted(document, [0, drop, 0]), null);
    this.say("It stands on the ground");
  }

  // --- the arrow keys ---

  // Steps to the right, to the back and up, as one sees it. A turn goes about the axis that the arrow would roll over.
  step(right, back, up) {
    const before = this.acts.state.scene;
    const pivot = this.#pivot();
    if (!pivot) return this.#measure();
    const frame = axes(this.acts.camera);
    const tool = this.tool();
    const [aside, away] = [nearest(frame.right), nearest(frame.forward)];
    const gesture = `${tool} ${this.#thing}`;
    if (tool === "move") {
      const box = this.#box();
      const size = box ? Math.max(...subtract(box.high, box.low)) : frame.distance / 4;
      const way = add(add(scale(aside, right), scale(away, back)), [0, up, 0]);
      this.#put(before, (document) => shifted(document, scale(way, STEP.move * size)), gesture);
    } else if (tool === "rotate") {
      const [axis, steps] = right ? [[0, 1, 0], right] : back ? [aside, -back] : [away, up];
      this.#put(before, (document) => this.#turned(document, axis, STEP.rotate * steps, pivot), gesture);
    } else {
      const steps = right + back + up;
      this.#put(before, (document) => mapped(document, growing(1 + STEP.scale * steps), pivot), gesture);
    }
    this.#tell(tool);
  }

  #tell(tool) {
    const document = this.#document;
    if (this.#isEnvironment) return this.say(`Rotation ${short(document.rotation)}°`);
    const box = this.#box();
    const point = box ? middle(box) : (document.position ?? document.direction);
    const told = tool === "scale" && box ? subtract(box.high, box.low) : point;
    const name = { move: "At", rotate: document.direction ? "Towards" : "Turned, at", scale: "Size" }[tool];
    this.say(`${name} ${told.map((x, k) => `${NAMES[k]} ${short(x)}`).join(", ")}`);
  }
}
