// The corner of the picture that shows how the world's axes lie, with a button for the view from the front, the top and
// the side.

import { axes } from "../document/camera.js";
import { element } from "../lib/dom.js";
import { add, dot, scale, tidy } from "../lib/vector.js";
import { WORLD } from "./handle-drags.js";
import { shape } from "./handle-shapes.js";

const REACH = 18; // of an axis, in pixels
const TILT = (2 * Math.PI) / 180; // short of the pole, where the view would lose its up
const VIEWS = {
  Front: [0, 0, 1],
  Top: [0, Math.cos(TILT), Math.sin(TILT)],
  Side: [1, 0, 0],
};

export class AxisViews {
  // `root` is its place over the picture, `acts` the editor; `say(text)`.
  constructor(root, acts, say) {
    this.acts = acts;
    this.drawing = shape("svg", { viewBox: "-28 -28 56 56", "aria-hidden": "true" });
    root.append(
      this.drawing,
      ...Object.entries(VIEWS).map(([name, from]) =>
        element(
          "button",
          {
            type: "button",
            class: "button",
            title: `Look from the ${name.toLowerCase()}`,
            onclick: () => {
              const { target } = acts.camera;
              acts.setCamera({
                position: tidy(add(target, scale(from, axes(acts.camera).distance))),
                ...(acts.camera.up.join() === "0,1,0" ? {} : { up: [0, 1, 0] }),
              });
              say(`From the ${name.toLowerCase()}`);
            },
          },
          name,
        ),
      ),
    );
  }

  // Draws the axes as the camera sees them, those that point away first.
  show() {
    const { right, up, forward } = axes(this.acts.camera);
    const seen = WORLD.map((axis, k) => ({
      name: "xyz"[k],
      x: REACH * dot(axis, right),
      y: -REACH * dot(axis, up),
      far: dot(axis, forward),
    })).sort((a, b) => b.far - a.far);
    this.drawing.replaceChildren(
      ...seen.map(({ name, x, y }) => {
        const letter = shape("text", { x: 1.25 * x, y: 1.25 * y });
        letter.textContent = name.toUpperCase();
        return shape("g", { class: `handle ${name}` }, shape("path", { d: `M0 0L${x} ${y}`, class: "seen" }), letter);
      }),
    );
  }
}
