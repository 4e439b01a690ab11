// The live picture seen from all round: the camera goes round its target, in what is shown and not in the scene. It waits
// for each picture, so that a slow renderer shows larger steps and not older pictures.

import { add, normalize, subtract, turn } from "../lib/vector.js";

const ROUND_MS = 24_000; // for a whole turn

export class Turntable {
  #began = null; // when it stood at the scene's own camera
  #calm = matchMedia("(prefers-reduced-motion: reduce)");

  // `page` is the PageState, `isNew()` says whether the newest picture is shown, `push()` asks for the next one; `stage` is
  // the picture's element; `ended()` hears that it stopped by itself.
  constructor({ page, acts, isNew, push, stage, ended }) {
    Object.assign(this, { page, acts, isNew, push, ended });
    this.#calm.addEventListener("change", () => {
      this.stop();
      ended();
    });
    // A hand takes over the view as it stands. First of all listeners, so that a drag begins there.
    const take = () => {
      if (!this.isTurning) return;
      const { camera } = this.page;
      this.stop();
      if (camera) this.acts.setCamera(camera);
      ended();
    };
    for (const kind of ["pointerdown", "wheel"]) stage.addEventListener(kind, take, { capture: true });
  }

  get isPossible() {
    return !this.#calm.matches;
  }

  get isTurning() {
    return this.#began !== null;
  }

  start() {
    if (this.isTurning || !this.isPossible) return;
    this.#began = performance.now();
    this.#step();
  }

  stop() {
    if (!this.isTurning) return;
    this.#began = null;
    this.page.camera = null;
    this.push();
  }

  #step() {
    requestAnimationFrame((now) => {
      if (!this.isTurning) return;
      if (this.acts.compared) {
        this.stop(); // the other variant would stand still
        return this.ended();
      }
      if (this.isNew()) {
        const { position, target, up } = this.acts.camera;
        const angle = (2 * Math.PI * (now - this.#began)) / ROUND_MS;
        this.page.camera = { position: add(target, turn(subtract(position, target), normalize(up), angle)) };
        this.push();
      }
      this.#step();
    });
  }
}
