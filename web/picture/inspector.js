// The picture under a glass: magnified to its pixels, with the values under the cursor, linear and displayed.

import { element } from "../lib/dom.js";
import { hex, toLinear } from "../lib/color.js";
import { Paced } from "../lib/paced.js";

const FRESH_MS = 800; // between two readings of the linear picture while it gets better
const MOST = 64;

const linearText = (x) =>
  Math.abs(x) >= 1000 || (x !== 0 && Math.abs(x) < 1e-4) ? x.toExponential(2) : x.toFixed(4);

export class Inspector {
  #zoom = 1;
  #x = 0;
  #y = 0;
  #at = null; // 0..1 in the picture
  #raw = null;
  #reading = new Paced(FRESH_MS, () => this.#read());

  // `places`: {stage, sheet, probe, crosshair}.
  constructor(places, viewport, stream) {
    Object.assign(this, places);
    this.viewport = viewport;
    this.stream = stream;
    this.active = false;
  }

  toggle(on) {
    if (on === this.active) return;
    this.active = on;
    this.probe.hidden = !on;
    this.forget();
    if (!on) this.#place(1, 0, 0);
    else this.#at ??= { x: 0.5, y: 0.5 };
    this.crosshair.hidden = !on;
    this.#aim();
    this.refresh();
  }

  #place(zoom, x, y) {
    const { clientWidth: w, clientHeight: h } = this.stage;
    this.#zoom = Math.min(Math.max(zoom, 1), MOST);
    this.#x = Math.min(0, Math.max(x, w * (1 - this.#zoom)));
    this.#y = Math.min(0, Math.max(y, h * (1 - this.#zoom)));
    this.sheet.style.setProperty("transform", `translate(${this.#x}px, ${this.#y}px) scale(${this.#zoom})`);
    this.sheet.classList.toggle("pixels", this.#zoom * (w / this.viewport.canvas.width) >= 2);
    this.#aim();
  }

  // About a point of the page, or about the cross.
  magnify(factor, clientX, clientY) {
    const box = this.stage.getBoundingClientRect();
    const cross = this.#point();
    const [px, py] = clientX === undefined ? [cross.x, cross.y] : [clientX - box.left, clientY - box.top];
    const zoom = Math.min(Math.max(this.#zoom * factor, 1), MOST);
    const grown = zoom / this.#zoom;
    this.#place(zoom, px - (px - this.#x) * grown, py - (py - this.#y) * grown);
  }

  slide(right, down) {
    this.#place(this.#zoom, this.#x + right, this.#y + down);
  }

  hover(clientX, clientY) {
    const place = this.viewport.place(clientX, clientY);
    if (!place) return;
    this.#at = place;
    this.#aim();
    this.#tell();
  }

  // By whole pixels.
  step(right, down) {
    const { width, height } = this.viewport.canvas;
    const clamp = (x, n) => (Math.min(Math.max(Math.floor(x * n), 0), n - 1) + 0.5) / n;
    this.#at = { x: clamp(this.#at.x + right / width, width), y: clamp(this.#at.y + down / height, height) };
    this.#aim();
    this.#tell();
  }

  // Of the cross, in the stage.
  #point() {
    const box = this.viewport.canvas.getBoundingClientRect();
    const stage = this.stage.getBoundingClientRect();
    const { width, height } = this.viewport.canvas;
    const zoom = Math.min(box.width / width, box.height / height);
    const { x, y } = this.#at ?? { x: 0.5, y: 0.5 };
    return {
      x: box.left - stage.left + box.width / 2 + (x - 0.5) * width * zoom,
      y: box.top - stage.top + box.height / 2 + (y - 0.5) * height * zoom,
    };
  }

  #aim() {
    if (!this.active) return;
    const { x, y } = this.#point();
    this.crosshair.style.setProperty("translate", `${x}px ${y}px`);
  }

  // After each frame: the linear values follow at their own pace.
  refresh() {
    if (!this.active) return;
    this.#tell();
    this.#reading.ask();
  }

  async #read() {
    if (!this.active) return;
    try {
      const { header, bytes } = await this.stream.capture({ format: "rgba32f", aov: "color", quality: null });
      this.#raw = { floats: new Float32Array(bytes), width: header.width, height: header.height };
    } catch {
      this.#raw = null; // the connection was lost, and says so itself
    }
    this.#tell();
  }

  // The picture of before is worth nothing any more.
  forget() {
    this.#raw = null;
    this.#reading.hurry();
  }

  #tell() {
    if (!this.active || !this.#at) return;
    const { width, height } = this.viewport.canvas;
    const [r, g, b] = this.viewport.pixel(this.#at);
    const rows = [
      ["Pixel", `${Math.floor(this.#at.x * width)}, ${Math.floor(this.#at.y * height)}`],
      ["Radiance", this.#linear()],
      ["Display", `${r} ${g} ${b}  ${hex([r, g, b].map((x) => toLinear(x / 255)))}`],
      ["Zoom", `${Number((this.#zoom * (this.stage.clientWidth / width)).toPrecision(2))}×`],
    ];
    this.probe.replaceChildren(...rows.flatMap(([name, text]) => [element("dt", {}, name), element("dd", {}, text)]));
  }

  #linear() {
    if (!this.#raw) return "…";
    const { floats, width, height } = this.#raw;
    const at = 4 * (Math.floor(this.#at.y * height) * width + Math.floor(this.#at.x * width));
    const [r, g, b, a] = floats.subarray(at, at + 4);
    return [r, g, b].map(linearText).join("  ") + (a < 1 ? `  α ${a.toFixed(3)}` : "");
  }
}
