// Small pictures of textures: made by the browser from the image's bytes where it can read them, else (EXR, HDR) by
// the service. One after the other, and each once. Their means are of the values that the renderer sees, however large.

import { fetchAsset, renderPicture, renderValues } from "../server/api.js";
import { hex, linear } from "../lib/color.js";

const SIDE = 64;
const SQUARES = 4; // of a checker, along each side
const PAUSE_MS = 300; // for which a texture that is computed must have stayed as it is before its picture is rendered
const MEAN_SAMPLES = 16; // of a pixel, which spread evenly over it

// A square of a black material that shines as the image tells, and fills the picture.
const lit = (black, texture, { looks = { emission: { texture: "image" } }, textures = {} } = {}) => ({
  version: 1,
  camera: { position: [0, 0, 1], target: [0, 0, 0], vfov: 90 },
  textures: { ...textures, image: texture },
  materials: { image: { ...black, ...looks } },
  shapes: [{ type: "quad", origin: [-1, -1, 0], u: [2, 0, 0], v: [0, 2, 0], material: "image" }],
});
// A square that shines where it is opaque.
const OPACITY = { emission: 1, alpha: { texture: "image", channel: "a" } };
const SETTINGS = { width: SIDE, height: SIDE, max_bounces: 0, filter: "box" };

const rendered = async (black, texture, textures = {}) =>
  createImageBitmap(await renderPicture(lit(black, texture, { textures }), { ...SETTINGS, max_samples: 4 }));

// What a texture that is computed reads besides its own numbers: the input of a ramp, as a table of textures.
function inputOf({ input }, textures = {}) {
  const name = input?.texture;
  return name !== undefined && textures[name] ? { [name]: textures[name] } : {};
}

// The mean colour of a square's picture, whose pixels are single-precision numbers behind the header of a .npy file.
async function meanOf(scene) {
  const file = await renderValues(scene, { ...SETTINGS, max_samples: MEAN_SAMPLES });
  const values = new Float32Array(file.slice(10 + new DataView(file).getUint16(8, true)));
  const channels = values.length / (SIDE * SIDE);
  return [0, 1, 2].map((k) => values.reduce((sum, x, i) => (i % channels === k ? sum + x : sum), 0) / (SIDE * SIDE));
}

function drawChecker(context, { a, b }) {
  const side = SIDE / SQUARES;
  for (let i = 0; i < SQUARES * SQUARES; i += 1) {
    const [x, y] = [i % SQUARES, Math.floor(i / SQUARES)];
    context.fillStyle = hex(linear((x + y) % 2 ? b : a));
    context.fillRect(x * side, y * side, side, side);
  }
}

// In the middle, and as large as it fits without a border.
function drawImage(context, bitmap) {
  const side = Math.min(bitmap.width, bitmap.height);
  context.drawImage(bitmap, (bitmap.width - side) / 2, (bitmap.height - side) / 2, side, side, 0, 0, SIDE, SIDE);
}

const shrink = (blob) => createImageBitmap(blob, { resizeHeight: SIDE, resizeQuality: "medium" });

export class TextureThumbnails {
  #bitmaps = new Map(); // by asset: a promise of a bitmap, or of null
  #means = new Map(); // by texture and what is read of it: a promise of [r, g, b, a]
  #last = Promise.resolve();

  // `black` is a material that reflects nothing.
  constructor(black) {
    this.black = black;
  }

  // An image that is on its way to the server needs not come back from there.
  keep(asset, file) {
    this.#bitmaps.set(
      asset,
      shrink(file)
        .catch(() => rendered(this.black, { asset }))
        .catch(() => null),
    );
  }

  // Of an image, perhaps of one of its layers, which no browser reads.
  #bitmap(asset, layer) {
    const key = layer === undefined ? asset : JSON.stringify([asset, layer]);
    if (!this.#bitmaps.has(key)) {
      const made = this.#last.then(async () => {
        try {
          if (layer !== undefined) return await rendered(this.black, { asset, layer });
          return await shrink(await fetchAsset(asset)).catch(() => rendered(this.black, { asset }));
        } catch {
          return null; // without a picture the name has to do
        }
      });
      this.#last = made;
      this.#bitmaps.set(key, made);
    }
    return this.#bitmaps.get(key);
  }

  // Resolves to the texture's mean, linear [r, g, b, a]; of an image that the service cannot read 1. `reads` is "color" or
  // a channel: images of 8 bits are sRGB where a colour is read, unless they say otherwise. Only alpha has a mean where
  // that is read, as an image without it cannot be asked for it.
  async mean(texture, reads, textures = {}) {
    if (texture.type === "checker") {
      const [a, b] = [linear(texture.a), linear(texture.b)];
      return [...a.map((x, i) => (x + b[i]) / 2), 1];
    }
    if (texture.type) {
      const inner = inputOf(texture, textures);
      const key = JSON.stringify([texture, inner]);
      const make = () => meanOf(lit(this.black, texture, { textures: inner })).then((color) => [...color, 1]);
      if (!this.#means.has(key))
        this.#means.set(
          key,
          make().catch(() => [1, 1, 1, 1]),
        );
      return this.#means.get(key);
    }
    const { asset, layer, color_space = reads === "color" ? undefined : "linear" } = texture;
    const key = JSON.stringify([asset, layer, color_space, reads === "a"]);
    if (!this.#means.has(key)) {
      const image = { asset, ...(layer ? { layer } : {}), ...(color_space ? { color_space } : {}) };
      const made =
        reads === "a"
          ? meanOf(lit(this.black, image, { looks: OPACITY })).then(([opacity]) => [1, 1, 1, opacity])
          : meanOf(lit(this.black, image)).then((color) => [...color, 1]);
      this.#means.set(
        key,
        made.catch(() => [1, 1, 1, 1]),
      );
    }
    return this.#means.get(key);
  }

  // Resolves to the picture of a texture that is computed, or null where it becomes another one meanwhile.
  async #computed(wanted, canvas, texture, inner) {
    if (!this.#bitmaps.has(wanted)) {
      await new Promise((done) => setTimeout(done, PAUSE_MS));
      if (canvas.dataset.shown !== wanted) return null;
    }
    if (!this.#bitmaps.has(wanted)) {
      const made = this.#last.then(() => rendered(this.black, texture, inner)).catch(() => null);
      this.#last = made;
      this.#bitmaps.set(wanted, made);
    }
    return this.#bitmaps.get(wanted);
  }

  // A canvas that shows the texture, now or as soon as there is a picture of it.
  paint(canvas, texture, textures = {}) {
    const inner = inputOf(texture, textures);
    const wanted = JSON.stringify(texture.type ? [texture, inner] : [texture.asset, texture.layer]);
    if (canvas.dataset.shown === wanted) return;
    Object.assign(canvas, { width: SIDE, height: SIDE });
    canvas.dataset.shown = wanted;
    const context = canvas.getContext("2d");
    if (texture.type === "checker") return drawChecker(context, texture);
    const found = texture.type ? this.#computed(wanted, canvas, texture, inner) : this.#bitmap(texture.asset, texture.layer);
    found.then((bitmap) => {
      if (bitmap && canvas.dataset.shown === wanted) drawImage(context, bitmap);
    });
  }
}
