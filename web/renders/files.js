// The files that a render is taken along as. Making one may take the server a while: layers are traced when they are
// first asked for. What is being made is said beside the render meanwhile.

import { prepareImage, renderImage } from "../server/api.js";
import { saveAs } from "../lib/files.js";
import { duration } from "../lib/format-text.js";
import { pictureFile } from "../document/file-name.js";
import { titleOf } from "./words.js";

export const FORMATS = {
  png: { title: "PNG", query: { format: "png" }, making: "Writing the PNG" },
  "png-16": { title: "PNG, 16 bit", query: { format: "png", bits: 16 }, making: "Writing the PNG", ending: "png" },
  exr: { title: "EXR", query: { format: "exr", aov: "all" }, making: "Tracing the layers of the EXR" },
  "exr-mattes": {
    title: "EXR with mattes",
    query: { format: "exr", aov: "all", cryptomatte: true },
    making: "Tracing the layers and mattes of the EXR",
    ending: "exr",
  },
  webp: { title: "WebP", query: { format: "webp" }, making: "Writing the WebP" },
  avif: { title: "AVIF", query: { format: "avif" }, making: "Writing the AVIF" },
};

const TICK_MS = 1000;
const megabytes = (bytes) => `${Math.max(0.1, bytes / 1e6).toFixed(bytes < 1e7 ? 1 : 0)} MB`;

export class RenderFiles {
  #making = new Map(); // by "id format": what is said of it

  // `view(render)`: the exposure, the tone map and the table it is displayed with; `changed(id)` when something else is to be said
  // of that render; `complain(problem)`, `say(text)`.
  constructor({ view, changed, complain, say }) {
    Object.assign(this, { view, changed, complain, say });
  }

  isMaking(id, format) {
    return this.#making.has(`${id} ${format}`);
  }

  // The sentences about the files of a render that are being made.
  words(id) {
    return [...this.#making].filter(([key]) => key.startsWith(`${id} `)).map(([, text]) => text);
  }

  // Has the server make a file before it is asked for. What goes wrong is said then.
  prepare(render, format) {
    prepareImage(render.id, { ...FORMATS[format].query, ...this.view(render) }).catch(() => {});
  }

  #tell(key, text) {
    this.#making.set(key, text);
    this.changed(key.split(" ")[0]);
  }

  async save(render, format) {
    const key = `${render.id} ${format}`;
    if (this.#making.has(key)) return;
    const { query, making, title, ending = format } = FORMATS[format];
    const began = performance.now();
    const tell = () => this.#tell(key, `${making}, ${duration((performance.now() - began) / 1000)} so far`);
    this.#tell(key, `${making}…`);
    this.say(`${making}…`);
    const timer = setInterval(tell, TICK_MS);
    try {
      const blob = await renderImage(
        render.id,
        { ...query, ...this.view(render) },
        {
          progress: (bytes, total) => {
            clearInterval(timer);
            const share = total
              ? `${Math.floor((100 * bytes) / total)}\u00a0% of ${megabytes(total)}`
              : megabytes(bytes);
            this.#tell(key, `Downloading the ${title}, ${share}`);
          },
        },
      );
      saveAs(blob, pictureFile(titleOf(render), { ...render.settings, samples: render.samples }, ending));
      this.say(`The ${title} is saved`);
    } catch (problem) {
      this.complain(problem);
    }
    clearInterval(timer);
    this.#making.delete(key);
    this.changed(render.id);
  }
}
