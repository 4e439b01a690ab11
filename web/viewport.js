// Frames in: decoded off the main thread, painted with the display's beat, acknowledged after that.

// Sides in pixels of a picture that fills the box at the device's ratio, within an area.
export function pictureSize({ width, height }, ratio, area) {
  const wanted = Math.max(1, width * ratio * height * ratio);
  const shrink = ratio * Math.min(1, Math.sqrt(area / wanted));
  return { width: Math.max(16, Math.round(width * shrink)), height: Math.max(16, Math.round(height * shrink)) };
}

export class Viewport {
  #context;
  #next = null; // the newest decoded frame that waits for the display
  #newest = -1; // its seq, or that of the frame on the canvas

  constructor(canvas, painted) {
    this.canvas = canvas;
    this.painted = painted;
    this.#context = canvas.getContext("2d");
    document.addEventListener("visibilitychange", () => { if (document.hidden) this.#drop(); });
  }

  // A new connection counts its frames from the beginning.
  restart() {
    this.#drop();
    this.#newest = -1;
  }

  async show(header, blob, acknowledge) {
    // A picture that cannot be decoded is dropped like a stale one: the next will come.
    const bitmap = document.hidden ? null : await createImageBitmap(blob).catch(() => null);
    if (!bitmap || document.hidden || header.seq < this.#newest) {
      bitmap?.close();
      return acknowledge();
    }
    const isFirst = this.#next === null;
    this.#drop();
    this.#newest = header.seq;
    this.#next = { header, bitmap, acknowledge };
    if (isFirst) requestAnimationFrame(() => this.#paint());
  }

  #drop() {
    if (!this.#next) return;
    this.#next.bitmap.close();
    this.#next.acknowledge();
    this.#next = null;
  }

  // A preview is drawn at the size it stands for, so that refining moves nothing; its own sides tell that
  // size only to a pixel or so of the preview's.
  #fit({ width, height, scale }) {
    const full = { width: Math.round(width / scale), height: Math.round(height / scale) };
    const slack = scale < 1 ? 1 / scale : 0;
    const fits = (side) => Math.abs(this.canvas[side] - full[side]) <= slack;
    if (!fits("width") || !fits("height")) Object.assign(this.canvas, full);
  }

  #paint() {
    if (!this.#next) return;
    const { header, bitmap, acknowledge } = this.#next;
    this.#next = null;
    this.#fit(header);
    const { width, height } = this.canvas;
    this.#context.imageSmoothingQuality = "high";
    this.#context.clearRect(0, 0, width, height);
    this.#context.drawImage(bitmap, 0, 0, width, height);
    bitmap.close();
    acknowledge();
    this.painted(header);
  }
}
