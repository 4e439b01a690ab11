// What can stand at a side of a comparison. Each has a `canvas`, `names` {long, short} in words, `header` {samples, scale}
// of the picture on it or null, `awaited` in words while that is null, `span` of the columns that it has or null for
// all, and `subject`: what the server compares, {scene, settings} or the id of a render, or null where it cannot.
// `show(wanted, paused)` tells it what the page wants, `settle()` that the frame may have another size.

import { element } from "../lib/dom.js";
import { inWords } from "../lib/format-text.js";
import { equal } from "../lib/patch.js";
import { recall } from "../lib/browser-storage.js";
import { visible } from "../document/outline.js";
import { revived } from "../document/share.js";
import { RENDER, SNAPSHOT, sceneOfB } from "../document/variants.js";
import { isEnded } from "../renders/renders.js";
import { momentOf, titleOf } from "../renders/words.js";
import { renderImage, renderStatus } from "../server/api.js";
import { Stream } from "../server/stream.js";
import { Viewport } from "../picture/viewport.js";

const GONE = [404, 410];
const LOOK_MS = 4000; // between two looks at a render that is under way
const REST_MS = 200; // an exposure under the hand fetches no picture
const FIRST_FRAME = "being prepared";

const canvasFor = (label) => element("canvas", { class: "half", role: "img", "aria-label": label });

// Variant A: the picture of the page itself.
export class First {
  awaited = FIRST_FRAME;
  span = null;

  constructor({ first, acts, headerOfA }) {
    Object.assign(this, { viewport: first, acts, headerOfA, canvas: first.canvas });
  }

  get header() {
    return this.headerOfA();
  }

  get names() {
    const { scene, compare } = this.acts.state;
    const model = inWords(scene.materials[compare.material]?.type ?? "");
    return { long: ["A", model], short: `A ${model}` };
  }

  show(wanted) {
    this.subject = subjectOf(wanted);
  }

  settle() {}

  pixels() {
    return this.viewport.pixels();
  }

  close() {}
}

// The settings without the size, which is the frame's and makes no other picture of it.
const subjectOf = ({ scene, settings: { width: _, height: __, ...settings } }) => ({ scene, settings });

// A scene that a stream of its own renders.
class Rendered {
  header = null;
  awaited = FIRST_FRAME;
  span = null;
  subject = null;
  #paused = false;

  // `needs`: names(aov, document) of layers, painted(), refused(problem, valid).
  constructor(canvas, { names, painted, refused }) {
    this.canvas = canvas;
    canvas.width = canvas.height = 1; // nothing of an earlier one is left
    this.viewport = new Viewport(canvas, {
      names: (aov) => names(aov, this.stream.document),
      painted: ({ header }) => {
        this.header = header;
        painted();
      },
    });
    this.stream = new Stream({
      hello: () => this.viewport.restart(),
      frame: (header, bytes, view, acknowledge) => this.viewport.show(header, bytes, view, acknowledge),
      done: painted,
      waiting() {},
      refused,
      // Of what else goes wrong the page's own stream tells; that there is no room may hold for this one alone.
      lost: (reason) => reason.full && refused(new Error("The server has no room for a second picture just now.")),
    });
    this.stream.connect();
  }

  render(wanted, paused) {
    this.subject = subjectOf(wanted);
    if (paused !== this.#paused) {
      this.#paused = paused;
      if (paused) this.stream.pause();
      else this.stream.resume();
    }
    this.stream.show(wanted);
  }

  settle() {}

  pixels() {
    return this.viewport.pixels();
  }

  close() {
    this.stream.close();
    this.viewport.close();
  }
}

// Variant B.
export class Second extends Rendered {
  constructor(canvas, needs) {
    super(canvas, needs);
    this.acts = needs.acts;
  }

  get names() {
    const model = inWords(this.acts.state.compare.document.type);
    return { long: ["B", model], short: `B ${model}` };
  }

  show(wanted, paused) {
    const { state } = this.acts;
    this.render({ ...wanted, scene: visible(sceneOfB(state), state.chosen.hidden) }, paused);
  }
}

export const snapshotTitle = (name) => `Snapshot, ${momentOf(name.slice(SNAPSHOT.length))}`;

// A snapshot, rendered again from its scene, at the size and the exposure of the picture.
export class Snapshot extends Rendered {
  #state = null;
  #latest = null;

  constructor(name, needs) {
    super(canvasFor(snapshotTitle(name)), needs);
    this.names = { long: [snapshotTitle(name)], short: snapshotTitle(name) };
    recall(name).then((kept) => {
      if (kept) this.#state = revived(kept.state);
      else this.awaited = "not in this browser any more";
      if (this.#state && this.#latest) this.show(...this.#latest);
      needs.painted();
    });
  }

  show(wanted, paused) {
    this.#latest = [wanted, paused];
    if (!this.#state) return;
    const { scene, settings, chosen } = this.#state;
    const { width, height } = wanted.settings;
    this.render(
      { ...wanted, scene: visible(scene, chosen.hidden), settings: { ...settings, width, height } },
      paused,
    );
  }
}

// A picture that is there as it is.
class Still {
  header = null;
  span = null;
  subject = null;

  constructor(label) {
    this.canvas = canvasFor(label);
    this.canvas.width = this.canvas.height = 1;
    this.context = this.canvas.getContext("2d", { willReadFrequently: true });
  }

  // `frame`: the canvas of the page's own picture, whose size it takes.
  fit(frame, isOther = false) {
    const isFitted = this.canvas.width === frame.width && this.canvas.height === frame.height;
    if (isFitted && !isOther) return;
    Object.assign(this.canvas, { width: frame.width, height: frame.height });
    this.draw();
  }

  settle() {
    this.fit(this.first.canvas);
  }

  pixels() {
    return this.context.getImageData(0, 0, this.canvas.width, this.canvas.height);
  }

  close() {}
}

// A final render, as the server has it, under the exposure and the tone map of the page.
export class Render extends Still {
  awaited = "being loaded";
  names = { long: ["Render"], short: "Render" };
  #bitmap = null;
  #painted;
  #shown = null; // the view that the picture is read with
  #reading = null;
  #timer = 0;

  constructor(id, { first, painted }) {
    super("A final render");
    Object.assign(this, { id, first, subject: id });
    this.#painted = painted;
  }

  show({ view: { exposure, tone_map, lut } }) {
    const view = { exposure, tone_map, ...(lut && { lut }) };
    if (equal(this.#shown, view)) return this.settle();
    const isFirst = this.#shown === null;
    this.#shown = view;
    this.#soon(isFirst ? 0 : REST_MS);
  }

  #soon(wait) {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#read(), wait);
  }

  async #read() {
    this.#reading?.abort();
    const reading = new AbortController();
    this.#reading = reading;
    try {
      const status = await renderStatus(this.id);
      const blob = await renderImage(this.id, { format: "png", ...this.#shown }, { signal: reading.signal });
      const bitmap = await createImageBitmap(blob);
      if (reading.signal.aborted) return bitmap.close();
      this.#bitmap?.close();
      this.#bitmap = bitmap;
      this.size = { width: bitmap.width, height: bitmap.height };
      this.header = { samples: status.samples, scale: 1 };
      this.names = { long: [titleOf(status)], short: titleOf(status) };
      this.canvas.setAttribute("aria-label", `The render ${titleOf(status)}`);
      this.fit(this.first.canvas, true);
      if (!isEnded(status)) this.#soon(LOOK_MS);
    } catch (problem) {
      if (reading.signal.aborted) return;
      const isGone = GONE.includes(problem.status);
      this.awaited = isGone ? "not on the server any more" : "waiting for its picture";
      if (!isGone) this.#soon(LOOK_MS);
    }
    this.#painted();
  }

  // As high as the frame, as a camera's field of view is that of the height: things of one camera lie on each other.
  draw() {
    if (!this.#bitmap) return;
    const { width, height } = this.canvas;
    const across = (this.#bitmap.width * height) / this.#bitmap.height;
    const left = (width - across) / 2;
    this.span = left > 0 ? [Math.ceil(left), Math.floor(left + across)] : null;
    this.context.imageSmoothingQuality = "high";
    this.context.drawImage(this.#bitmap, left, 0, across, height);
  }

  close() {
    clearTimeout(this.#timer);
    this.#reading?.abort();
    this.#bitmap?.close();
  }
}

// A photograph, or the place for one.
export class Photo extends Still {
  awaited = "not chosen yet";
  #photograph = null;
  #stops = null;

  constructor({ first, photograph }) {
    super("The photograph");
    Object.assign(this, { first, photograph });
  }

  get names() {
    const name = this.photograph()?.name ?? "Photograph";
    return { long: [name], short: name };
  }

  show() {
    const photograph = this.photograph();
    const isOther = photograph !== this.#photograph || photograph?.stops !== this.#stops;
    [this.#photograph, this.#stops] = [photograph, photograph?.stops];
    this.header = photograph && { samples: 0, scale: 1 };
    this.fit(this.first.canvas, isOther);
  }

  draw() {
    this.#photograph?.paint(this.canvas);
  }
}

// What a name stands for. `needs` as the classes have them, with `second`, the canvas of B.
export function sideOf(name, needs) {
  if (name === "a") return new First(needs);
  if (name === "b") return new Second(needs.second, needs);
  if (name.startsWith(SNAPSHOT)) return new Snapshot(name, { ...needs, refused: needs.complain });
  if (name.startsWith(RENDER)) return new Render(name.slice(RENDER.length), needs);
  return new Photo(needs);
}
