// What lies under a place in the picture: asked of the renderer's own layers, and kept while the view stays.

import { around, boxAround } from "./bounds.js";
import { eye, ray } from "./camera.js";
import { add, scale } from "../lib/vector.js";

const RAW = { format: "rgba32f", quality: null, bits: 8 };
const PATIENCE_MS = 3000; // after which a preview tells what is under a hand
const NEAR = 0.01; // of the picture's height: how far apart two clicks at the same place are at most

// Whether two places in the picture, 0..1, are one for a hand.
export const isThere = (a, b, aspect) => Math.hypot((a.x - b.x) * aspect, a.y - b.y) < NEAR;

export class Picker {
  #stream;
  #camera = null;
  #shapes = null;
  #layers = new Map();

  constructor(stream) {
    this.#stream = stream;
  }

  // {floats, width, height, camera}: a layer of the present picture, row 0 at the top.
  async layer(aov, scene, patience_ms = PATIENCE_MS) {
    if (scene.camera !== this.#camera || scene.shapes !== this.#shapes) {
      [this.#camera, this.#shapes] = [scene.camera, scene.shapes];
      this.#layers.clear();
    }
    if (!this.#layers.has(aov)) {
      const {
        header,
        bytes,
        scene: shown,
      } = await this.#stream.capture({ ...RAW, aov }, { patience_ms, rough: true });
      const layer = { floats: new Float32Array(bytes), width: header.width, height: header.height };
      const isStale = shown?.camera !== this.#camera || shown?.shapes !== this.#shapes; // things moved meanwhile
      if (isStale || header.scale < 1) return layer;
      this.#layers.set(aov, layer);
    }
    return this.#layers.get(aov);
  }

  forget() {
    this.#layers.clear();
  }

  async #values(aov, scene, { x, y }) {
    const { floats, width, height } = await this.layer(aov, scene);
    const at = 4 * (Math.floor(y * height) * width + Math.floor(x * width));
    return [...floats.subarray(at, at + 3)];
  }

  // The index of the shape there, or null.
  async shape(scene, place) {
    const id = Math.round((await this.#values("shape_id", scene, place))[0]);
    return id > 0 ? id - 1 : null;
  }

  // Along the ray, in metres; 0 where nothing is.
  async depth(scene, place) {
    return (await this.#values("depth", scene, place))[0];
  }

  // The mean normal of what is seen there, of whatever length.
  normal(scene, place) {
    return this.#values("normal", scene, place);
  }

  // What can be seen of each shape: lists of points, by its index.
  async #clouds(scene, camera, patience_ms) {
    const ids = await this.layer("shape_id", scene, patience_ms);
    const depths = await this.layer("depth", scene, patience_ms);
    const { width, height } = ids;
    const clouds = new Map();
    if (depths.width !== width || depths.height !== height) return clouds; // a preview, and then a larger one
    for (let j = 0; j < height; j += 2) {
      for (let i = 0; i < width; i += 2) {
        const at = 4 * (j * width + i);
        const shape = Math.round(ids.floats[at]) - 1;
        if (shape < 0 || !(depths.floats[at] > 0)) continue;
        if (!clouds.has(shape)) clouds.set(shape, []);
        const through = [camera, (i + 0.5) / width, (j + 0.5) / height, width / height];
        clouds.get(shape).push(add(eye(...through), scale(ray(...through), depths.floats[at])));
      }
    }
    return clouds;
  }

  // The points that can be seen of a shape, or null.
  async cloud(scene, camera, shape) {
    return (await this.#clouds(scene, camera)).get(shape) ?? null;
  }

  // The ball around what can be seen of a shape, or null.
  async ball(scene, camera, shape) {
    const cloud = (await this.#clouds(scene, camera)).get(shape);
    return cloud ? around(cloud) : null;
  }

  // The boxes around what can be seen of each shape, by its index.
  async boxes(scene, camera, patience_ms) {
    const clouds = await this.#clouds(scene, camera, patience_ms);
    return new Map([...clouds].map(([shape, cloud]) => [shape, boxAround(cloud)]));
  }
}
