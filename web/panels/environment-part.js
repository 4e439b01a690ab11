// The environment in the inspector: a ball that mirrors it, in a ring that turns it.

import { wrapped } from "../document/manipulation.js";
import { element } from "../lib/dom.js";
import { watchDrags } from "../lib/drag.js";

const STEPS = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 15, PageDown: -15 };
const SNAP = 15; // degrees, with Ctrl
const PLACE = "/scene/environment/rotation";

export class EnvironmentPart {
  #environment = null;
  #drawn = null;

  // `root` is its place on the page, `acts` the editor.
  constructor(root, acts) {
    Object.assign(this, { root, acts });
    this.canvas = element("canvas", { "aria-hidden": "true" });
    this.ring = element("div", {
      class: "ring",
      role: "slider",
      tabindex: "0",
      "aria-label": "Turn of the ball",
      "aria-valuemin": "-180",
      "aria-valuemax": "180",
      title: "Drag to turn the environment; with Ctrl by 15°",
      onkeydown: (event) => this.#step(event),
      onkeyup: ({ key }) => {
        if (STEPS[key]) acts.endGesture();
      },
    });
    root.append(this.canvas, this.ring);
    watchDrags(this.ring, (event) => this.#begin(event));
  }

  get #rotation() {
    return this.#environment.rotation ?? 0;
  }

  #step(event) {
    const steps = STEPS[event.key];
    if (!steps) return;
    event.preventDefault();
    event.stopPropagation();
    this.acts.edit(PLACE, wrapped(this.#rotation + steps));
  }

  // Where round the ring a hand is, in degrees: counter-clockwise, as the rotation is seen from above.
  #angle({ clientX, clientY }) {
    const { left, top, width, height } = this.ring.getBoundingClientRect();
    return (-Math.atan2(clientY - top - height / 2, clientX - left - width / 2) * 180) / Math.PI;
  }

  #begin(event) {
    const [before, from] = [this.#environment.rotation, this.#angle(event)];
    this.ring.focus();
    return {
      move: (now) => {
        const to = (before ?? 0) + this.#angle(now) - from;
        this.acts.edit(PLACE, wrapped(now.ctrlKey || now.metaKey ? SNAP * Math.round(to / SNAP) : Math.round(to)));
      },
      end: (isCancelled) => {
        if (isCancelled) this.acts.edit(PLACE, before);
        this.acts.endGesture();
      },
    };
  }

  // `environment` is the scene's, or null where another thing is selected.
  show(environment) {
    this.root.hidden = !environment;
    this.#environment = environment;
    if (!environment) return;
    const degrees = this.#rotation;
    this.ring.setAttribute("aria-valuenow", String(degrees));
    this.ring.setAttribute("aria-valuetext", `${degrees}°`);
    this.ring.style.setProperty("--turn", `${-degrees}deg`);
    this.#draw(environment, degrees);
  }

  async #draw(environment, degrees) {
    try {
      const { ballsOf, drawBall } = await import("../picture/environment-ball.js");
      const balls = await ballsOf(environment);
      const isLate = environment !== this.#environment;
      const isDone = this.#drawn?.balls === balls && this.#drawn.degrees === degrees;
      if (isLate || isDone) return;
      this.#drawn = { balls, degrees };
      drawBall(this.canvas, balls, degrees);
    } catch {
      // The server says elsewhere what it does not take, or that it is away.
    }
  }
}
