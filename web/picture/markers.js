// Lights over the picture: a mark where each one is, an arrow at the picture's edge to one that is outside of it, and the
// outline of one that is a shape. A click selects it; a drag, or the arrow keys, slide it round what it shines at, with
// Shift they change its distance. What the camera looks at has a mark where it is asked for.

import { axes } from "../document/camera.js";
import { farther, lampsOf, positionOf, slid, targetOf } from "../document/lamps.js";
import { element } from "../lib/dom.js";
import { watchDrags } from "../lib/drag.js";
import { things } from "../document/things.js";
import { icon } from "../lib/icon.js";
import { add, normalize, scale } from "../lib/vector.js";
import { shape } from "./handle-shapes.js";
import { clearOf, outlinePath, spot } from "./lamp-outlines.js";

const FAR = 1e4; // distances to the target: where a sun stands, that has a direction alone
const ARROW_PX = 10; // how far the tip of an arrow sticks out of its mark
const STILL = 4; // CSS pixels that a hand may slip during a click
const TURN = Math.PI; // of a light, by a drag across the picture
const STEP = Math.PI / 90; // by an arrow key
const NEARER = 1.04; // the factor of the distance of such a step
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

const placeOf = (document, camera) =>
  positionOf(document) ??
  (document.direction && add(camera.target, scale(normalize(document.direction), -FAR * axes(camera).distance)));

// What lies over the picture's edges, and marks stay clear of.
const OVER = ".outliner, .tools, .pill, .axis-views, .comparison, .hint, .corner > *";

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
        acts.endGesture();
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
        path: outlinePath(document, { camera, aspect, height }),
      }))
      .filter(({ point }) => point);
    const target = { thing: "/camera", icon: "camera", title: "What the camera looks at", point: camera.target };
    const marks = [...lamps, ...(hasTarget ? [target] : [])]
      .map((each) => ({ ...each, isChosen: each.thing === chosen.thing, ...spot(camera, each.point, aspect) }))
      .filter(({ isInside, isChosen, icon: name }) => isInside || isChosen || name === "light");
    this.#outlines.replaceChildren(
      ...marks
        .filter(({ path }) => path)
        .map(({ thing, path, isChosen }) =>
          shape("path", { d: path, "data-thing": thing, class: isChosen ? "lamp chosen" : "lamp" }),
        ),
    );
    this.#make(marks);
    const places = this.#places(marks, aspect * height, height);
    marks.forEach(({ isInside, isChosen, way }, i) => {
      const mark = this.#buttons.children[i];
      mark.style.setProperty("left", `${places[i].x}px`);
      mark.style.setProperty("top", `${places[i].y}px`);
      mark.style.setProperty("--way", `${way ?? 0}rad`);
      mark.classList.toggle("outside", !isInside);
      mark.classList.toggle("chosen", isChosen);
      mark.tabIndex = isChosen ? 0 : -1;
    });
  }

  // Where the marks stand in pixels of the picture: those that lead outside clear of one another and of what lies over the
  // picture's edges, the chosen one first.
  #places(marks, width, height) {
    const plain = marks.map(({ x, y }) => ({ x: x * width, y: y * height }));
    if (marks.every(({ isInside }) => isInside)) return plain;
    const own = this.root.getBoundingClientRect();
    const onto = ({ left, top, right, bottom }) => ({
      left: left - own.left,
      top: top - own.top,
      right: right - own.left,
      bottom: bottom - own.top,
    });
    const boxes = [...document.querySelectorAll(OVER)]
      .filter((each) => each.checkVisibility())
      .map((each) => onto(each.getBoundingClientRect()));
    const seen = onto(this.root.closest(".stage").getBoundingClientRect());
    const room = {
      left: Math.max(0, seen.left),
      top: Math.max(0, seen.top),
      right: Math.min(width, seen.right),
      bottom: Math.min(height, seen.bottom),
    };
    const size = (this.#buttons.firstElementChild?.offsetWidth ?? 0) / 2 + ARROW_PX;
    const order = marks.map((_, i) => i).sort((a, b) => marks[b].isChosen - marks[a].isChosen);
    for (const i of order) {
      if (marks[i].isInside) continue;
      const { x, y } = clearOf(plain[i], size, boxes, room);
      plain[i] = { x, y };
      boxes.push({ left: x - size, top: y - size, right: x + size, bottom: y + size });
    }
    return plain;
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
