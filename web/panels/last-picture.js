// The picture that was last seen of a scene, until there is one as good: what was sharp does not turn blurred before it
// is sharp again. Who touches the page sees what there is at once. The first scene's comes with the page.

import { recall, remember } from "../lib/browser-storage.js";

const NAME = "last picture ";
const WORK = "work"; // a scene that was changed; a built-in one has its own name
const LONGEST = 960; // pixels of the longer side: some 50 kB
const FIRST = "shader-ball"; // the scene of the page's own picture
const FADE_MS = 300; // until the canvas covers it
const NOISE = 0.2; // with the denoiser, nearly as clean as what is kept: four samples of the first scene
const TOUCHES = ["pointerdown", "keydown", "wheel", "drop"];

// What a picture is of: {name, of}; `builtIn` is the name of a built-in scene as it comes, else null.
export const subject = ({ scene, hidden = [] }, builtIn) =>
  builtIn === null ? { name: WORK, of: JSON.stringify([scene, hidden]) } : { name: builtIn, of: "" };

export class LastPicture {
  #isOver = false;
  #isPainted = false;
  #isTouched = false;
  #listening = new AbortController();

  // `image` lies under the canvas of `stage`, which has the class "live" from the frame on that is to be seen.
  constructor(image, stage) {
    this.image = image;
    this.stage = stage;
    const options = { capture: true, passive: true, signal: this.#listening.signal };
    for (const type of TOUCHES) addEventListener(type, () => this.#touch(), options);
  }

  // Shows what is kept of a subject, if there is something.
  async show({ name, of }) {
    if (name !== FIRST) this.image.hidden = true;
    const kept = await recall(NAME + name);
    if (!kept || kept.of !== of || this.#isOver) return;
    this.image.classList.remove("first");
    this.image.src = URL.createObjectURL(kept.blob);
    this.image.hidden = false;
  }

  // A frame stands on the canvas.
  painted({ scale, noise }) {
    this.#isPainted = true;
    if (this.#isTouched || this.image.hidden || (scale === 1 && noise !== null && noise < NOISE)) this.end();
  }

  // The canvas is seen, unless nothing stands on it.
  end() {
    if (this.#isOver || !this.#isPainted) return;
    this.#isOver = true;
    this.#listening.abort();
    this.stage.classList.add("live");
    setTimeout(() => {
      this.image.hidden = true;
      URL.revokeObjectURL(this.image.src);
    }, FADE_MS);
  }

  #touch() {
    this.#isTouched = true;
    this.end();
  }

  // Keeps the canvas for the next visit, as a picture of a subject.
  async keep(canvas, { name, of }) {
    const zoom = Math.min(1, LONGEST / Math.max(canvas.width, canvas.height));
    const small = new OffscreenCanvas(Math.ceil(canvas.width * zoom), Math.ceil(canvas.height * zoom));
    small.getContext("2d").drawImage(canvas, 0, 0, small.width, small.height);
    await remember(NAME + name, { of, blob: await small.convertToBlob({ type: "image/webp", quality: 0.8 }) });
  }
}
