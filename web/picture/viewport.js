// Frames in: decoded off the main thread, painted with the display's beat, acknowledged after that.

import { fullSize, isPainted, isWide } from "../document/picture-view.js";

export class Viewport {
  #context;
  #next = null; // the newest decoded frame that waits for the display
  #newest = -1; // its seq, or that of the frame on the canvas
  #drop = () => {
    if (document.hidden) this.drop();
  };

  // `painted({header, view, legend})` after each frame; `names(aov)` tells what the numbers of a layer stand for.
  constructor(canvas, { painted, names }) {
    this.canvas = canvas;
    this.painted = painted;
    this.names = names;
    const colorSpace = isWide ? "display-p3" : "srgb";
    this.#context = canvas.getContext("2d", { willReadFrequently: true, colorSpace });
    document.addEventListener("visibilitychange", this.#drop);
  }

  close() {
    document.removeEventListener("visibilitychange", this.#drop);
    this.drop();
  }

  // A new connection counts its frames from the beginning.
  restart() {
    this.drop();
    this.#newest = -1;
  }

  async #decode(header, bytes, view) {
    if (view.aov === "color" && view.format !== "rgba32f")
      return { bitmap: await createImageBitmap(new Blob([bytes], { type: header.mime })) };
    const { LEGENDS, paintLayer } = await import("./aov.js"); // for other layers than the first picture's
    if (view.format !== "rgba32f") {
      return { bitmap: await createImageBitmap(new Blob([bytes], { type: header.mime })), legend: LEGENDS[view.aov] };
    }
    const { width, height } = header;
    const { image, legend } = paintLayer(view.aov, new Float32Array(bytes), width, height, this.names(view.aov));
    return { bitmap: await createImageBitmap(image), legend };
  }

  async show(header, bytes, view, acknowledge) {
    // A picture that cannot be decoded is dropped like a stale one: the next will come.
    const decoded = document.hidden ? null : await this.#decode(header, bytes, view).catch(() => null);
    if (!decoded || document.hidden || header.seq < this.#newest) {
      decoded?.bitmap.close();
      return acknowledge();
    }
    const isFirst = this.#next === null;
    this.drop();
    this.#newest = header.seq;
    this.#next = { header, view, ...decoded, acknowledge };
    if (isFirst) requestAnimationFrame(() => this.#paint());
  }

  drop() {
    if (!this.#next) return;
    this.#next.bitmap.close();
    this.#next.acknowledge();
    this.#next = null;
  }

  // A preview is drawn at the size it stands for, so that refining moves nothing.
  #fit(header) {
    const full = fullSize(header);
    const slack = header.scale < 1 && !header.prior ? 1 / header.scale : 0;
    const fits = (side) => Math.abs(this.canvas[side] - full[side]) <= slack;
    if (!fits("width") || !fits("height")) Object.assign(this.canvas, full);
  }

  #paint() {
    if (!this.#next) return;
    const { header, view, bitmap, legend, acknowledge } = this.#next;
    this.#next = null;
    this.#fit(header);
    const { width, height } = this.canvas;
    this.#context.imageSmoothingEnabled = !isPainted(view.aov);
    this.#context.imageSmoothingQuality = "high";
    this.#context.clearRect(0, 0, width, height);
    this.#context.drawImage(bitmap, 0, 0, width, height);
    bitmap.close();
    acknowledge();
    this.painted({ header, view, legend });
  }

  // The place of a point of the page in the picture, 0..1 from the left and the top; null outside of it.
  place(clientX, clientY) {
    const box = this.canvas.getBoundingClientRect();
    const { width, height } = this.canvas;
    const zoom = Math.min(box.width / width, box.height / height); // object-fit: contain
    const x = 0.5 + (clientX - box.left - box.width / 2) / (width * zoom);
    const y = 0.5 + (clientY - box.top - box.height / 2) / (height * zoom);
    return x >= 0 && x < 1 && y >= 0 && y < 1 ? { x, y } : null;
  }

  pixels() {
    return this.#context.getImageData(0, 0, this.canvas.width, this.canvas.height, { colorSpace: "srgb" });
  }

  // The displayed colour at a place, in sRGB, 0..255.
  pixel({ x, y }) {
    const { width, height } = this.canvas;
    const at = [Math.floor(x * width), Math.floor(y * height), 1, 1];
    return [...this.#context.getImageData(...at, { colorSpace: "srgb" }).data];
  }
}
