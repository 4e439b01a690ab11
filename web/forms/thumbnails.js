// Pictures of materials, rendered by the service: those of its presets lie beside this page, the others are
// asked for when the main picture is at rest, one at a time, and kept in the browser.

import { fetchPreset, renderPicture } from "../server/api.js";
import { recall, remember } from "../lib/browser-storage.js";

const SIDE = 96;
const SETTINGS = { width: SIDE, height: SIDE, max_samples: 32, max_bounces: 6, seed: 1 };

// The stage that every material stands on: the one that `tests/bench/thumbnails.py` takes the presets in.
export async function studio() {
  const [set, environment] = await Promise.all([
    fetch(beside("studio.json")).then((answer) => answer.json()),
    fetchPreset("environments", "studio"),
  ]);
  return { ...set, environment };
}

export const staged = (scene, material) => ({ ...scene, materials: { ...scene.materials, subject: material } });

const beside = (name) => new URL(`thumbnails/${name}`, document.baseURI);

const hash = async (document) => {
  const digest = await crypto.subtle.digest("SHA-256", new TextEncoder().encode(JSON.stringify(document)));
  return [...new Uint8Array(digest.slice(0, 12))].map((byte) => byte.toString(16).padStart(2, "0")).join("");
};

export class Thumbnails {
  #queue = [];
  #working = null;
  #scene = null;
  #index = null;

  // `isIdle()`: the server has nothing better to do.
  constructor(isIdle) {
    this.isIdle = isIdle;
  }

  // The picture of a preset, or of what `get` gives where there is none.
  async preset(image, name, get) {
    this.#index ??= fetch(beside("index.json"))
      .then((answer) => answer.json())
      .catch(() => ({}));
    if ((await this.#index)[name]) image.src = beside(`${encodeURIComponent(name)}.webp`).href;
    else this.#queue.push({ image, get });
  }

  own(image, material) {
    this.#queue.push({ image, get: async () => material });
    this.work();
  }

  // Call when the picture came to rest.
  async work() {
    if (this.#working || !this.#queue.length || !this.isIdle()) return;
    const item = this.#queue.shift();
    this.#working = item;
    try {
      await this.#make(item);
    } catch {
      // Without a picture the name has to do: a thumbnail is no reason to complain.
    }
    this.#working = null;
    this.work();
  }

  async #make({ image, get }) {
    const material = await get();
    const name = `thumbnail ${self.crypto.subtle ? await hash(material) : JSON.stringify(material)}`;
    let blob = await recall(name);
    if (!blob) {
      this.#scene ??= await studio();
      // Textures belong to a scene: a thumbnail shows the material without them.
      const plain = Object.fromEntries(Object.entries(material).filter(([, value]) => !value?.texture));
      blob = await renderPicture(staged(this.#scene, plain), SETTINGS);
      remember(name, blob);
    }
    image.src = URL.createObjectURL(blob);
    image.addEventListener("load", () => URL.revokeObjectURL(image.src), { once: true });
  }
}
