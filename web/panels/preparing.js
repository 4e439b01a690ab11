// While the renderer prepares something else than the canvas shows: the old picture is dimmed, a line over it says
// what is being prepared and for how long, and the readings, which are the old picture's, are blank.

const CHANGE_MS = 1500; // a change that is answered sooner needs no word
const SCENE_MS = 250; // another scene must not be taken for the old one

export class Preparing {
  #since = null;
  #timer = 0;

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
    if (!is) this.#since = null;
    else {
      this.#since ??= performance.now();
      this.#look();
    }
  }

  // The canvas shows what is wanted, or there is nothing to wait for any more.
  end() {
    this.wait(false);
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
    const seconds = Math.floor(waited / 1000);
    this.label.textContent = `Preparing ${name}…${seconds >= 2 ? ` ${seconds} s` : ""}`;
    if (!this.isShown) {
      this.label.hidden = false;
      this.stage.classList.add("stale");
      this.begun();
    }
    this.#timer = setTimeout(() => this.#look(), 1000 - (waited % 1000));
  }
}
