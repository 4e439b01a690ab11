// Lights and the camera's target have no surface to be seen: a mark shows where they are, over the picture, and a
// click on it selects them. Shown while the scene is arranged; what is selected has one at the edge where it is outside.

import { axes, project } from "../document/camera.js";
import { element } from "../lib/dom.js";
import { things } from "../document/things.js";
import { icon } from "../lib/icon.js";
import { at } from "../lib/patch.js";
import { add, normalize, scale } from "../lib/vector.js";

const FAR = 1e4; // distances to the target: where a sun stands, that has a direction alone
const EDGE = 0.04; // of the picture: how far inside of it a mark stays

function placeOf({ position, direction }, camera) {
  if (position) return position;
  return add(camera.target, scale(normalize(direction), -FAR * axes(camera).distance));
}

// Where in the picture a mark stands: {x, y} 0..1, and whether the point itself is in it.
export function spot(camera, point, aspect) {
  const { x, y, z } = project(camera, point, aspect);
  if (z > 0 && x >= 0 && x <= 1 && y >= 0 && y <= 1) return { x, y, isInside: true };
  // From the middle towards it, as far as the edge; what is behind the eye appears mirrored.
  const way = z > 0 ? [x - 0.5, y - 0.5] : [0.5 - x, 0.5 - y];
  const reach = (0.5 - EDGE) / Math.max(Math.abs(way[0]), Math.abs(way[1]), 1e-9);
  return { x: 0.5 + way[0] * reach, y: 0.5 + way[1] * reach, isInside: false };
}

export class Markers {
  #shown = "";

  // `root` lies over the picture, `acts` is the editor.
  constructor(root, acts) {
    Object.assign(this, { root, acts });
    root.addEventListener("pointerdown", (event) => {
      if (event.target.closest("button")) event.stopPropagation();
    }); // no orbit
    root.addEventListener("click", ({ target }) => {
      const mark = target.closest("[data-thing]");
      if (mark) acts.select(mark.dataset.thing);
    });
  }

  // `aspect` of the picture, which lies where the overlays do.
  show(isOn, aspect) {
    this.root.hidden = !isOn;
    if (!isOn) return;
    const { state, camera } = this.acts;
    const { scene, chosen } = state;
    const lights = things({ lights: scene.lights, shapes: [] }).filter(({ thing }) => thing.startsWith("/lights/"));
    const marks = [...lights, { thing: "/camera", icon: "camera", title: "What the camera looks at" }]
      .map((each) => {
        const point = each.thing === "/camera" ? camera.target : placeOf(at(scene, each.thing), camera);
        return { ...each, isChosen: each.thing === chosen.thing, ...spot(camera, point, aspect) };
      })
      .filter(({ isInside, isChosen }) => isInside || isChosen);
    const made = JSON.stringify(marks.map(({ thing, title }) => [thing, title]));
    if (made !== this.#shown) {
      this.#shown = made;
      this.root.replaceChildren(
        ...marks.map(({ thing, icon: name, title }) =>
          element(
            "button",
            { type: "button", class: "mark", tabindex: "-1", "data-thing": thing, "aria-label": title, title },
            icon(name),
          ),
        ),
      );
    }
    marks.forEach(({ x, y, isInside, isChosen }, i) => {
      const mark = this.root.children[i];
      mark.style.setProperty("left", `${100 * x}%`);
      mark.style.setProperty("top", `${100 * y}%`);
      mark.classList.toggle("outside", !isInside);
      mark.classList.toggle("chosen", isChosen);
    });
  }
}
