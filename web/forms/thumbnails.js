// Pictures of materials, rendered by the service: those of its presets lie beside this page, the others are
// asked for when the main picture is at rest, one at a time, and kept in the browser.

import { HEX, hex, linear } from "../lib/color.js";
import { equal } from "../lib/patch.js";
import { unpacked } from "../document/material-set.js";

const SIDE = 144;
const code = () => import("./thumbnail-rendering.js"); // the first picture does without

const beside = (name) => new URL(`thumbnails/${name}`, document.baseURI);

// Those in shut drawers, or beyond a list's edge, wait until somebody looks.
function fetchWhenSeen(image, name) {
  image.loading = "lazy";
  image.src = beside(name).href;
}

// Calls `then` once, when the image comes into sight.
function onceSeen(image, then) {
  const watch = new IntersectionObserver((seen) => {
    if (!seen.some(({ isIntersecting }) => isIntersecting)) return;
    watch.disconnect();
    then();
  });
  watch.observe(image);
}

const GREY = 0.4;
const isColor = (value) => HEX.test(value) || (Array.isArray(value) && value.length === 3);

export function show(image, blob) {
  const url = URL.createObjectURL(blob);
  image.src = url;
  image.addEventListener("load", () => URL.revokeObjectURL(url), { once: true });
}

// A ball of a colour, lit from above.
function ball(color) {
  const canvas = new OffscreenCanvas(SIDE, SIDE);
  const context = canvas.getContext("2d");
  const [middle, radius] = [SIDE / 2, 0.42 * SIDE];
  const shade = context.createRadialGradient(0.8 * middle, 0.6 * middle, 2, middle, middle, 1.1 * radius);
  const tint = linear(color);
  shade.addColorStop(0, hex(tint.map((x) => x + 0.35 * (1 - x))));
  shade.addColorStop(0.35, hex(tint));
  shade.addColorStop(1, hex(tint.map((x) => 0.08 * x)));
  context.fillStyle = shade;
  context.arc(middle, middle, radius, 0, 2 * Math.PI);
  context.fill();
  return canvas.convertToBlob();
}

// What a material looks like, whatever it and its textures' set are called: [material, textures].
const looks = (document) => unpacked(document).map(({ material, textures }) => [material, textures])[0];

export class Thumbnails {
  #queue = [];
  #working = null;
  #presets = new Map(); // looks of material presets that were fetched, by name

  // `isIdle()`: the server has nothing better to do; `ready` resolves when the network has not.
  constructor(isIdle, ready) {
    Object.assign(this, { isIdle, ready });
  }

  // The picture of a material preset, or of what `get` gives if there is none.
  async preset(image, name, get) {
    await this.ready;
    this.#fetch(image, `${encodeURIComponent(name)}.webp`, () => onceSeen(image, () => this.later(image, get)));
  }

  // The picture of a scene or an environment, of which only presets have one.
  async place(image, kind, name) {
    await this.ready;
    this.#fetch(image, `${kind}/${encodeURIComponent(name)}.webp`);
  }

  // Where there is no such file a grey ball is shown, and `otherwise` is called.
  #fetch(image, path, otherwise = () => {}) {
    const isMissing = async () => {
      await this.plain(image, GREY);
      otherwise();
    };
    image.addEventListener("error", isMissing, { once: true });
    fetchWhenSeen(image, path);
  }

  // Remembers a material preset: a material that looks the same shows the preset's picture.
  knows(name, document) {
    this.#presets.set(name, looks(document));
  }

  // A plain ball of a colour.
  async plain(image, color) {
    show(image, await ball(color));
  }

  // The middle of a picture that is there already, until another is asked for.
  async atOnce(image, picture) {
    image.dataset.shown = "stage"; // before the wait: the material itself may come meanwhile
    show(image, await (await code()).cropped(picture));
  }

  // The picture of what `get` gives, once there is time for it; an older wish for the same image is dropped. Where it is
  // not to be `rendered`, one is shown that was rendered before.
  later(image, get, isRendered = true) {
    if (!image.src && !image.dataset.shown) this.plain(image, GREY);
    this.#drop(image);
    this.#queue.push({ image, get, isRendered });
    this.work();
  }

  #drop(image) {
    this.#queue = this.#queue.filter((each) => each.image !== image);
  }

  // The picture of a material of the scene, bare or with its textures: a ball of its colour, when that is new, until the
  // service has rendered it. What no thing wears stays so: nothing is prepared for that.
  async own(image, document, isWorn) {
    const [material, textures] = looks(document);
    const same = [...this.#presets].find(([, preset]) => equal(preset, [material, textures]));
    const tint = same?.[0] ?? String(Object.values(material).find(isColor) ?? GREY);
    const isNew = image.dataset.tint !== tint;
    image.dataset.tint = tint;
    if (same) {
      this.#drop(image);
      if (isNew) fetchWhenSeen(image, `${encodeURIComponent(same[0])}.webp`);
      return;
    }
    if (isNew) await this.plain(image, Object.values(material).find(isColor) ?? GREY);
    this.later(image, async () => document, isWorn);
  }

  // The picture of a material that users saved, which `get` fetches once the image is seen.
  saved(image, get) {
    onceSeen(image, async () => {
      const document = await get();
      if (image.dataset.shown) this.later(image, async () => document);
      else this.own(image, document, true);
    });
  }

  // Call when the picture comes to rest, and when it goes on: what is being rendered then makes room and waits again.
  async work() {
    if (this.#working && !this.isIdle()) this.#working.abort();
    if (this.#working || !this.#queue.length || !this.isIdle()) return;
    const item = this.#queue.shift();
    this.#working = new AbortController();
    const { signal } = this.#working;
    try {
      await this.#make(item, signal);
    } catch {
      // Without a picture the name has to do: a thumbnail is no reason to complain.
      if (signal.aborted && !this.#queue.some(({ image }) => image === item.image)) this.#queue.unshift(item);
    }
    this.#working = null;
    this.work();
  }

  async #make({ image, get, isRendered }, signal) {
    const { rendered } = await code();
    const blob = await rendered(await get(), isRendered, signal);
    if (blob) show(image, blob);
  }
}
