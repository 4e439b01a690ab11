// While the renderer prepares something else than the canvas shows: what that is, for how long it has been prepared, and
// how long that may go on. The last picture stays as it is; the readings, which are that one's, are blank.

import { Durations } from "../lib/durations.js";

const CHANGE_MS = 500; // a change that is answered sooner needs no word
const SCENE_MS = 250; // another scene must not be taken for the old one
const LONG_S = 2; // what takes less is not remembered, and nobody asks for how long

export class Preparing {
  #since = null;
  #timer = 0;
  #took = 0; // milliseconds, the last wait
  #isSaid = false; // what takes so long was read out
  #kinds = []; // of what is being prepared, the nearest first
  #durations = new Durations("sunbox.preparing");

  // `label` is an element; `subject()` gives {name, isOther}: what is wanted, and whether the canvas shows another scene;
  // `begun()` is called once the words are shown, `say(text)` reads out what takes long.
  constructor({ label, subject, begun, say }) {
    Object.assign(this, { label, subject, begun, say });
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
    this.label.textContent = `${name}${this.#time(Math.floor(waited / 1000))}`;
    if (!this.isShown) {
      this.label.hidden = false;
      this.begun();
    }
    if (waited >= 1000 * LONG_S && !this.#isSaid) this.say(`Preparing ${name}`);
    this.#isSaid = waited >= 1000 * LONG_S;
    this.#timer = setTimeout(() => this.#look(), 1000 - (waited % 1000));
  }

  // ": 5 s, about 8 s left", the latter by what such a thing took before.
  #time(seconds) {
    if (seconds < 1) return "";
    const all = seconds < LONG_S ? null : this.#durations.expected(this.#kinds, seconds);
    return `: ${seconds} s${all === null ? "" : `, about ${Math.ceil(all - seconds)} s left`}`;
  }
}
