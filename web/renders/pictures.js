// Small pictures of renders. The server reads a picture from the disk for each, so they are made one at a time, for those
// that are in sight, and remembered by the browser.

import { renderImage } from "../server/api.js";
import { dismiss, recall, recallAll, remember } from "../lib/browser-storage.js";
import { hasPicture, isEnded } from "./renders.js";

const NAME = "render "; // in the browser's storage, followed by the render's id
const WIDTH = 320; // pixels, of a card at twice the density
const AGAIN = 4; // times the samples after which one that runs is read anew: half the noise

async function small(blob) {
  const whole = await createImageBitmap(blob);
  const size = { width: Math.min(WIDTH, whole.width) };
  size.height = Math.max(1, Math.round((size.width * whole.height) / whole.width));
  const canvas = new OffscreenCanvas(size.width, size.height);
  const context = canvas.getContext("2d");
  context.imageSmoothingQuality = "high";
  context.drawImage(whole, 0, 0, size.width, size.height);
  whole.close();
  return canvas.convertToBlob({ type: "image/webp", quality: 0.85 });
}

export class RenderPictures {
  #made = new Map(); // by id: {blob, samples, ended}
  #waiting = new Map(); // by id: the newest render that is to be shown, and where
  #isWorking = false;

  // `view(render)`: the exposure and the tone map to show it with.
  constructor({ view }) {
    this.view = view;
  }

  // Shows the picture of a render in an <img>, now or once it is there.
  show(image, render) {
    const made = this.#made.get(render.id);
    if (made) put(image, made.blob);
    if (!hasPicture(render)) return;
    if (made?.ended || (made && !isEnded(render) && render.samples < AGAIN * made.samples)) return;
    this.#waiting.set(render.id, { image, render });
    this.#work();
  }

  forget(ids) {
    for (const id of ids) {
      this.#made.delete(id);
      this.#waiting.delete(id);
      dismiss(NAME + id);
    }
  }

  // Forgets the pictures of all other renders.
  async keepOnly(ids) {
    const names = new Set(ids.map((id) => NAME + id));
    for (const { name } of await recallAll(NAME)) if (!names.has(name)) dismiss(name);
  }

  async #work() {
    if (this.#isWorking) return;
    this.#isWorking = true;
    while (this.#waiting.size) {
      const [[id, { image, render }]] = this.#waiting;
      this.#waiting.delete(id);
      try {
        const blob = (isEnded(render) && (await recall(NAME + id))) || (await this.#make(render));
        this.#made.set(id, { blob, samples: render.samples, ended: isEnded(render) });
        put(image, blob);
      } catch {
        // Without a picture the name has to do; a render that is looked at again tries again.
      }
    }
    this.#isWorking = false;
  }

  async #make(render) {
    const blob = await small(await renderImage(render.id, { format: "webp", ...this.view(render) }));
    if (isEnded(render)) remember(NAME + render.id, blob);
    return blob;
  }
}

function put(image, blob) {
  if (image.shown === blob) return;
  image.shown = blob;
  const url = URL.createObjectURL(blob);
  image.src = url;
  image.addEventListener("load", () => URL.revokeObjectURL(url), { once: true });
  image.classList.add("painted");
}
