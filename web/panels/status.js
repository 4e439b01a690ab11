// The pill at the foot of the picture: how far it is and how good; and, opened, how fast, how long and by whom.

import { fullSize } from "../document/picture-view.js";
import { count, duration, percent } from "../lib/format-text.js";

const NOTHING = "–";
const PLACES = ["samples", "rate", "noise", "elapsed", "left", "progress", "preview", "denoised", "state", "size"];

export class Status {
  #places = {};

  constructor(root) {
    for (const name of PLACES) this.#places[name] = root.querySelector(`#${name}`);
  }

  // A frame's header; `limit` is the number of samples at which the picture is ready, or null.
  frame(header, limit) {
    const { samples, noise, elapsed_s, eta_s, scale } = header;
    const { width, height } = fullSize(header);
    const places = this.#places;
    places.size.textContent = `${width}\u202f×\u202f${height}`;
    places.samples.textContent = limit ? `${count(samples)} / ${count(limit)}` : count(samples);
    const rate = samples / elapsed_s;
    places.rate.textContent = Number.isFinite(rate) ? Number(rate.toPrecision(2)) : NOTHING;
    places.noise.textContent = noise === null ? NOTHING : `${percent(noise)} noise`;
    places.elapsed.textContent = duration(elapsed_s);
    places.left.textContent = eta_s ? `${duration(eta_s)} left` : NOTHING;
    places.noise.hidden = noise === null;
    places.left.hidden = !eta_s;
    places.progress.value = eta_s === null ? (limit ? samples / limit : 0) : elapsed_s / (elapsed_s + eta_s || 1);
    places.preview.hidden = scale >= 1;
    places.denoised.hidden = !header.denoised;
    places.preview.textContent = `1/${Math.round(1 / scale)} size`;
  }

  // The readings of a picture that is no longer wanted are nobody's.
  blank() {
    for (const name of ["samples", "rate", "noise", "elapsed", "left", "size"])
      this.#places[name].textContent = NOTHING;
    for (const name of ["noise", "left", "preview", "denoised"]) this.#places[name].hidden = true;
    this.#places.progress.value = 0;
  }

  // "Converging", "Paused", "Done", ...: the word that leads the line.
  state(word) {
    if (this.#places.state.textContent === word) return;
    this.#places.state.textContent = word;
    this.#places.state.dataset.state = word.toLowerCase().replaceAll(" ", "-");
  }
}
