// Small pictures of textures: made by the browser from the image's bytes where it can read them, else (EXR, HDR) by
// the service. One after the other, and each once.

import { fetchAsset, renderPicture } from "./api.js";
import { hex, linear, toLinear } from "./color.js";

const SIDE = 64;
const SQUARES = 4; // of a checker, along each side

// A square that shines as the image tells, and fills the picture.
const lit = (texture) => ({
  version: 1, camera: { position: [0, 0, 1], target: [0, 0, 0], vfov: 90 }, textures: { image: texture },
  materials: { image: { type: "diffuse", albedo: 0, emission: { texture: "image" } } },
  shapes: [{ type: "quad", origin: [-1, -1, 0], u: [2, 0, 0], v: [0, 2, 0], material: "image" }],
});

async function rendered(asset) {
  const settings = { width: SIDE, height: SIDE, max_samples: 4, max_bounces: 0 };
  return createImageBitmap(await renderPicture(lit({ asset }), settings));
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
  #last = Promise.resolve();

  // An image that is on its way to the server needs not come back from there.
  keep(asset, file) { this.#bitmaps.set(asset, shrink(file).catch(() => rendered(asset)).catch(() => null)); }

  #bitmap(asset) {
    if (!this.#bitmaps.has(asset)) {
      const made = this.#last.then(async () => {
        try {
          return await shrink(await fetchAsset(asset)).catch(() => rendered(asset));
        } catch {
          return null; // without a picture the name has to do
        }
      });
      this.#last = made;
      this.#bitmaps.set(asset, made);
    }
    return this.#bitmaps.get(asset);
  }

  // Resolves to the texture's mean, linear [r, g, b, a]; of an image without a picture 1. `isColor`: images of 8 bits
  // are sRGB where a colour is read, unless they say otherwise.
  async mean(texture, isColor) {
    if (texture.type === "checker") {
      const [a, b] = [linear(texture.a), linear(texture.b)];
      return [...a.map((x, i) => (x + b[i]) / 2), 1];
    }
    const bitmap = await this.#bitmap(texture.asset);
    if (!bitmap) return [1, 1, 1, 1];
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
    context.drawImage(bitmap, 0, 0);
    const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
    const isEncoded = (texture.color_space ?? (isColor ? "srgb" : "linear")) === "srgb";
    const decode = (byte) => (isEncoded ? toLinear(byte / 255) : byte / 255);
    const sums = [0, 0, 0, 0];
    for (let i = 0; i < data.length; i += 4) {
      for (let k = 0; k < 3; k += 1) sums[k] += decode(data[i + k]);
      sums[3] += data[i + 3] / 255;
    }
    return sums.map((sum) => (4 * sum) / data.length);
  }

  // A canvas that shows the texture, now or as soon as there is a picture of it.
  paint(canvas, texture) {
    const wanted = JSON.stringify([texture.asset, texture.a, texture.b]);
    if (canvas.dataset.shown === wanted) return;
    Object.assign(canvas, { width: SIDE, height: SIDE });
    canvas.dataset.shown = wanted;
    const context = canvas.getContext("2d");
    if (texture.type === "checker") return drawChecker(context, texture);
    this.#bitmap(texture.asset).then((bitmap) => {
      if (bitmap && canvas.dataset.shown === wanted) drawImage(context, bitmap);
    });
  }
}
