// Lights over the picture: a mark where each one is, and the outline of one that is a shape. A click selects it; a drag, or
// the arrow keys, slide it round what it shines at, with Shift they change its distance. What the camera looks at has a
// mark where it is asked for.

import { axes, project } from "../document/camera.js";
import { farther, lampsOf, outlineOf, positionOf, slid, targetOf } from "../document/lamps.js";
import { element } from "../lib/dom.js";
import { watchDrags } from "../lib/drag.js";
import { things } from "../document/things.js";
import { icon } from "../lib/icon.js";
import { add, normalize, scale } from "../lib/vector.js";
import { metresPerPixel } from "./handle-drags.js";
import { shape } from "./handle-shapes.js";

const FAR = 1e4; // distances to the target: where a sun stands, that has a direction alone
const EDGE = 0.04; // of the picture: how far inside of it a mark stays
const STILL = 4; // CSS pixels that a hand may slip during a click
const TURN = Math.PI; // of a light, by a drag across the picture
const STEP = Math.PI / 90; // by an arrow key
const NEARER = 1.04; // the factor of the distance of such a step
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

const placeOf = (document, camera) =>
  positionOf(document) ??
  (document.direction && add(camera.target, scale(normalize(document.direction), -FAR * axes(camera).distance)));

// Where in the picture a mark stands: {x, y} 0..1, and whether the point itself is in it.
export function spot(camera, point, aspect) {
  const { x, y, z } = project(camera, point, aspect);
  if (z > 0 && x >= 0 && x <= 1 && y >= 0 && y <= 1) return { x, y, isInside: true };
  // From the middle towards it, as far as the edge; what is behind the eye appears mirrored.
  const way = z > 0 ? [x - 0.5, y - 0.5] : [0.5 - x, 0.5 - y];
  const reach = (0.5 - EDGE) / Math.max(Math.abs(way[0]), Math.abs(way[1]), 1e-9);
  return { x: 0.5 + way[0] * reach, y: 0.5 + way[1] * reach, isInside: false };
}

// The outline of a lamp in pixels of the picture, as an SVG path; empty where it has none, or is not all before the eye.
function pathOf(document, view) {
  const { camera, aspect, height } = view;
  const outline = outlineOf(document);
  if (!outline) return "";
  if (outline.center) {
    const { x, y, z } = project(camera, outline.center, aspect);
    const r = outline.radius / metresPerPixel(view, outline.center);
    if (z <= outline.radius) return "";
    return `M${x * aspect * height - r} ${y * height}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0Z`;
  }
  const corners = outline.map((point) => project(camera, point, aspect));
  if (corners.some(({ z }) => z <= 0)) return "";
  return `M${corners.map(({ x, y }) => `${x * aspect * height} ${y * height}`).join("L")}Z`;
}

export class Markers {
  #shown = "";
  #buttons = element("div", {});
  #outlines = shape("svg", { class: "outlines", "aria-hidden": "true" });

  // `root` lies over the picture, `acts` is the editor; `say(text)`.
  constructor(root, acts, say) {
    Object.assign(this, { root, acts, say });
    root.append(this.#outlines, this.#buttons);
    watchDrags(root, (event) => this.#begin(event));
    root.addEventListener("keydown", (event) => this.#step(event));
  }

  #lamp(thing) {
    return lampsOf(this.acts.state.scene).find((each) => each.thing === thing)?.document;
  }

  #begin(event) {
    const thing = event.target.closest("[data-thing]")?.dataset.thing;
    if (!thing || event.altKey) return null;
    const { acts } = this;
    const [before, camera] = [this.#lamp(thing), acts.camera];
    const target = before && targetOf(acts.state.scene, before, camera);
    const gesture = `slide ${thing}`;
    let isMoved = false;
    return {
      move: (now) => {
        const [right, down] = [now.clientX - event.clientX, now.clientY - event.clientY];
        isMoved ||= Math.hypot(right, down) >= STILL;
        if (!isMoved || !before) return;
        if (acts.state.chosen.thing !== thing) acts.select(thing);
        const { clientWidth: w, clientHeight: h } = this.root;
        const document = now.shiftKey
          ? farther(before, target, 2 ** ((-2 * down) / h))
          : slid(before, target, camera, (right / w) * TURN, (-down / w) * TURN);
        acts.edit(`/scene${thing}`, document, gesture);
      },
      end: (isCancelled) => {
        if (!isMoved) acts.select(thing);
        else if (isCancelled && before) acts.edit(`/scene${thing}`, before, gesture);
        acts.rest();
      },
    };
  }

  #step(event) {
    const thing = event.target.closest("[data-thing]")?.dataset.thing;
    const lamp = thing && this.#lamp(thing);
    const arrow = ARROWS[event.key];
    if (event.key === "Enter" && thing) this.acts.select(thing);
    if (!lamp || !arrow) return;
    event.preventDefault();
    event.stopPropagation();
    const { acts } = this;
    const target = targetOf(acts.state.scene, lamp, acts.camera);
    const document = event.shiftKey
      ? farther(lamp, target, NEARER ** (arrow[0] + arrow[1]))
      : slid(lamp, target, acts.camera, STEP * arrow[0], STEP * arrow[1]);
    acts.edit(`/scene${thing}`, document, null);
    const point = positionOf(document) ?? document.direction;
    this.say(`Light at ${point.map((x) => Number(x.toPrecision(3))).join(", ")}`);
  }

  // `aspect` and `height` in CSS pixels are those of the picture, which lies where the overlays do; `hasTarget`: whether
  // what the camera looks at has a mark.
  show(isOn, aspect, height, hasTarget) {
    this.root.hidden = !isOn;
    if (!isOn) return;
    const { state, camera } = this.acts;
    const { scene, chosen } = state;
    const titles = new Map(things(scene).map(({ thing, title }) => [thing, title]));
    const lamps = lampsOf(scene)
      .map(({ thing, document }) => ({
        thing,
        icon: "light",
        title: titles.get(thing),
        point: placeOf(document, camera),
        path: pathOf(document, { camera, aspect, height }),
      }))
      .filter(({ point }) => point);
    const target = { thing: "/camera", icon: "camera", title: "What the camera looks at", point: camera.target };
    const marks = [...lamps, ...(hasTarget ? [target] : [])]
      .map((each) => ({ ...each, isChosen: each.thing === chosen.thing, ...spot(camera, each.point, aspect) }))
      .filter(({ isInside, isChosen, path }) => isInside || isChosen || path);
    this.#outlines.replaceChildren(
      ...marks
        .filter(({ path }) => path)
        .map(({ thing, path, isChosen }) =>
          shape("path", { d: path, "data-thing": thing, class: isChosen ? "lamp chosen" : "lamp" }),
        ),
    );
    this.#make(marks);
    marks.forEach(({ x, y, isInside, isChosen }, i) => {
      const mark = this.#buttons.children[i];
      mark.style.setProperty("left", isInside ? `${100 * x}%` : `min(${100 * x}%, 100% - var(--axes))`);
      // One outside of the picture stays clear of the tools, the pill and the axes, which lie over its edges.
      mark.style.setProperty(
        "top",
        isInside ? `${100 * y}%` : `clamp(var(--clear), ${100 * y}%, 100% - var(--clear))`,
      );
      mark.classList.toggle("outside", !isInside);
      mark.classList.toggle("chosen", isChosen);
      mark.tabIndex = isChosen ? 0 : -1;
    });
  }

  #make(marks) {
    const made = JSON.stringify(marks.map(({ thing, title }) => [thing, title]));
    if (made === this.#shown) return;
    this.#shown = made;
    this.#buttons.replaceChildren(
      ...marks.map(({ thing, icon: name, title }) =>
        element(
          "button",
          { type: "button", class: "mark", "data-thing": thing, "aria-label": title, title },
          icon(name),
        ),
      ),
    );
  }
}
