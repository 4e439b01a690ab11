// What the page knows of its picture, and what follows from that: the renderer's greeting, the newest frame, whether
// it is paused, connected, done; the size and the limit that hold for the next one.

import { visible } from "./outline.js";
import { compared, rendered } from "./variants.js";
import { inWords } from "../lib/format-text.js";
import { defaults } from "../server/schema.js";
import { DISPLAY, FINAL, contained, fillsBox, liveArea, pictureSize, viewOf } from "./picture-view.js";

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

  // The pixels of the picture on the page: all of the final frame is in it, whether that is prepared or not.
  get size() {
    const whole = this.windowSize;
    const { frame } = this;
    // The sides of the whole are not rounded again.
    const isWhole = frame.width === whole.width && frame.height === whole.height;
    const isFilled = fillsBox(this.root.getBoundingClientRect(), frame, this.editor.state.scene.camera);
    return isWhole || isFilled ? whole : this.#sizeOf(frame);
  }

  // What it would be if it filled its place.
  get windowSize() {
    return this.#sizeOf(null);
  }

  // The sides of the final picture.
  get frame() {
    const { width, height } = this.editor.state.settings;
    if (width && height) return { width, height };
    return FINAL.width * FINAL.height > this.info.limits.max_pixels ? this.windowSize : FINAL;
  }

  // Whether colour is seen denoised. Its size is that of the other layers, which must not begin anew.
  get isDenoised() {
    return Boolean(this.ui.state.denoised || this.editor.state.settings.denoise);
  }

  #sizeOf(shape) {
    const area = Math.min(liveArea(this.info.renderer ?? {}, this.isDenoised), this.info.limits.max_pixels);
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
