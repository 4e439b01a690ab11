// What the page knows of its picture, and what follows from that: the renderer's greeting, the newest frame, whether
// it is paused, connected, done; the size and the limit that hold for the next one.

import { visible } from "./outline.js";
import { compared, rendered } from "./variants.js";
import { inWords } from "../lib/format-text.js";
import { defaults } from "../server/schema.js";
import { DISPLAY, FINAL, contained, pictureSize, viewOf } from "./picture-view.js";

// Pixels that a renderer traces fast enough to follow the hand.
const AREA = { software: 512 * 512, hardware: 1920 * 1080 };

// JPEG quality of a picture that somebody paused to look at; else the server chooses (null), by whether it still changes.
const PAUSED_QUALITY = 90;

export class PageState {
  info = null; // the server's greeting
  isPaused = false;
  isConnected = false;
  isWaiting = false; // an update is under way
  ended = null; // the generation that is done
  painted = 0; // the generation on the canvas
  paintedHome = null; // the scene on the canvas, as it was picked
  paintedScene = null; // the same, as it was seen last
  header = null; // of the frame on the canvas
  camera = null; // members of the camera that is shown in the place of the scene's, while a turntable turns
  knobs = {}; // what the chosen quality makes of the settings that are not given

  // `root` is the element of the picture; `fit(box)` gives the part of a box that one of two pictures has.
  constructor({ schema, editor, ui, root, fit }) {
    Object.assign(this, { schema, editor, ui, root, fit });
    this.viewDefaults = defaults(schema.view, schema.view, DISPLAY);
    this.layers = schema.view.properties.aov.enum;
  }

  // A frame stands on the canvas.
  paint({ header }) {
    this.header = header;
    this.painted = header.generation;
    if (this.isWaiting) return;
    this.paintedHome = this.editor.state.home;
    this.paintedScene = this.wanted.scene;
  }

  get isDone() {
    return this.ended === this.painted && !this.isWaiting;
  }

  // The most samples that the picture gets, or null.
  get limit() {
    return this.editor.state.settings.max_samples ?? this.knobs.max_samples ?? null;
  }

  get view() {
    return { ...this.viewDefaults, ...this.editor.state.view };
  }

  // Transparency shows where the scene asks for it, or the person does.
  get isCheckered() {
    return this.ui.state.checker ?? this.editor.state.scene.environment?.background === false;
  }

  // The pixels of the picture on the page. While a final picture is prepared it has that one's shape, so that what will be
  // in it is seen.
  get size() {
    return this.#in(this.#chosenShape ?? (this.ui.state.tab === "render" ? FINAL : null));
  }

  // What it would be if it filled its place, where no shape was chosen.
  get windowSize() {
    return this.#in(this.#chosenShape);
  }

  // The sides that were chosen, or null.
  get #chosenShape() {
    const { width, height } = this.editor.state.settings;
    return width && height ? { width, height } : null;
  }

  // The pixels in a shape, or in the whole window, whose own sides are not rounded again.
  #in(shape) {
    const whole = this.#sizeOf(null);
    const isWhole = !shape || (shape.width === whole.width && shape.height === whole.height);
    return isWhole ? whole : this.#sizeOf(shape);
  }

  #sizeOf(shape) {
    const area = Math.min(
      this.info.renderer?.software === false ? AREA.hardware : AREA.software,
      this.info.limits.max_pixels,
    );
    const stageBox = this.root.getBoundingClientRect();
    const box = shape ? contained(stageBox, shape) : stageBox;
    // Those that are rendered at a time share what one may cost.
    return pictureSize(this.fit(box), window.devicePixelRatio, area / rendered(this.editor.state));
  }

  // The settings as the stream is given them.
  get settings() {
    return { ...this.editor.state.settings, ...this.size };
  }

  // What the stream is asked for: {scene, settings, view}.
  get wanted() {
    const view = viewOf({ ...this.ui.state, checkered: this.isCheckered }, this.view, {
      isPaused: this.isPaused,
      quality: PAUSED_QUALITY,
      isExact: compared(this.editor.state) !== null,
    });
    const { scene: own, chosen } = this.editor.state;
    const scene = this.camera ? { ...own, camera: { ...own.camera, ...this.camera } } : own;
    return { scene: visible(scene, chosen.hidden), settings: this.settings, view };
  }

  // Looks up what the quality preset makes of the settings that are not given.
  resolve() {
    const {
      quality = this.schema.settings.properties.quality.default,
      time_limit,
      target_noise,
    } = this.editor.state.settings;
    const preset = this.info?.quality[quality] ?? {};
    this.knobs = time_limit || target_noise ? { ...preset, max_samples: null } : preset;
  }

  // The one word for how things stand.
  word(isPreparing) {
    if (!this.isConnected) return "Offline";
    if (this.isPaused) return "Paused";
    if (this.isDone) return "Done";
    if (isPreparing || !this.header) return "Preparing";
    return this.header.scale < 1 ? "Preview" : "Converging";
  }
}

// The names behind the numbers of a layer that counts shapes or materials.
export const namesOf = (layer, { shapes, materials }) =>
  layer === "shape_id"
    ? shapes.map(({ type, material }, i) => `${i + 1} ${inWords(type)}, ${inWords(material)}`)
    : Object.keys(materials).map(inWords);
