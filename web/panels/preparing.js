// While the renderer prepares something else than the canvas shows: the old picture is dimmed, a line over it says
// what is being prepared, for how long, and how long that may go on; the readings, which are the old picture's, are
// blank.

import { Durations } from "../lib/durations.js";

const CHANGE_MS = 1500; // a change that is answered sooner needs no word
const SCENE_MS = 250; // another scene must not be taken for the old one
const LONG_S = 2; // from which on it is said how long it takes

export class Preparing {
  #since = null;
  #timer = 0;
  #took = 0; // milliseconds, the last wait
  #kinds = []; // of what is being prepared, the nearest first
  #durations = new Durations("sunbox.preparing");

  // `stage` and `label` are elements; `subject()` gives {name, isOther}: what is wanted, and whether the canvas shows
  // another scene; `begun()` is called once the words are shown.
  constructor({ stage, label, subject, begun }) {
    Object.assign(this, { stage, label, subject, begun });
  }

  get isShown() {
    return !this.label.hidden;
  }

  // An update left, or was answered.
  wait(is) {
    clearTimeout(this.#timer);
    if (!is) {
      if (this.#since !== null) this.#took = performance.now() - this.#since;
      this.#since = null;
    } else {
      this.#since ??= performance.now();
      this.#look();
    }
  }

  // The canvas shows what is wanted.
  painted() {
    this.wait(false);
    const seconds = this.#took / 1000;
    if (this.isShown && seconds >= LONG_S) for (const kind of this.#kinds) this.#durations.add(kind, seconds);
    this.end();
  }

  // It does, or there is nothing to wait for any more.
  end() {
    this.wait(false);
    this.#took = 0;
    this.label.hidden = true;
    this.stage.classList.remove("stale");
  }

  #look() {
    const { name, isOther } = this.subject();
    const waited = performance.now() - this.#since;
    const left = (isOther ? SCENE_MS : CHANGE_MS) - waited;
    if (left > 0) {
      this.#timer = setTimeout(() => this.#look(), left);
      return;
    }
    this.#kinds = isOther ? [`scene ${name}`, "scene"] : ["change"];
    const wasShown = this.stage.classList.contains("stale");
    this.label.textContent = `Preparing ${name}…${this.#time(Math.floor(waited / 1000))}`;
    if (!wasShown) {
      this.label.hidden = false;
      this.stage.classList.add("stale");
      this.begun();
    }
    this.#timer = setTimeout(() => this.#look(), 1000 - (waited % 1000));
  }

  // " 5 s, about 8 s left", the latter by what such a thing took before.
  #time(seconds) {
    if (seconds < LONG_S) return "";
    const all = this.#durations.expected(this.#kinds, seconds);
    return ` ${seconds} s${all === null ? "" : `, about ${Math.ceil(all - seconds)} s left`}`;
  }
}
