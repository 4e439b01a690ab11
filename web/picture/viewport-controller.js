// The picture under the hand: gestures, keys, and the tools, whose code comes once there is a picture.

import { axes, frame, halfHeight } from "../document/camera.js";
import { watchGestures } from "./gestures.js";
import { NotReady } from "../server/stream.js";
import { watchToolbar } from "../lib/tabs.js";
import { OnDemand, useSheet } from "../lib/on-demand.js";
import { HANDLED } from "../document/ui-state.js";

// A click before there is a picture.
const EARLY = {
  focus: "One moment: the picture is not ready. Click again to focus.",
  highlight: "One moment: the picture is not ready. Click again to place the highlight.",
  select: "One moment: the picture is not ready. Until then, choose things in the outline.",
};

export class ViewportController {
  #frame = {}; // the newest one on the canvas
  #composed = 1; // the final frame's width by its height, as far as the picture on the page is wide

  // `find(id)` elements, `acts` the editor, `ui`, `stream`, `viewport`; `say(text)`, `complain(error)`.
  constructor(parts) {
    Object.assign(this, parts);
    const { find, acts, ui } = parts;
    this.root = find("stage");
    this.tools = new OnDemand(
      async () => (await Promise.all([import("./tools.js"), useSheet("tools.css")]))[0],
      ({ Tools }) => new Tools(this),
      {
        complain: parts.complain,
        arrived: (tools) => {
          tools.painted(this.#frame);
          this.showUi(ui.state);
        },
      },
    );
    this.move = {
      ...acts.moves,
      zoom: (factor, x, y) => (this.#glass ? this.#glass.magnify(1 / factor, x, y) : acts.moves.zoom(factor)),
      slide: (right, down) => this.#glass?.slide(right, down),
      hover: (x, y) => this.#glass?.hover(x, y),
      tap: (x, y, isAlt) => this.tap(x, y, isAlt),
    };
    // The arrows move the cross, or change the selection, where that is the tool.
    const stepped = (steps, orElse) => (right, down) => {
      if (this.#glass) this.#glass.step(steps * Math.sign(right), steps * Math.sign(down));
      else if (this.#handles) this.#handles.step(steps * Math.sign(right), -steps * Math.sign(down), 0);
      else orElse(right, down);
    };
    // A tool that was picked early has its keys as soon as it is there.
    const isAwaited = () => !this.tools.now && ["inspect", ...HANDLED].includes(ui.state.tool);
    const once = (act) => (isAwaited() ? this.tools.get().then(act, parts.complain) : act());
    this.keyMove = {
      ...this.move,
      orbit: (right, down) => once(() => stepped(1, acts.moves.orbit)(right, down)),
      pan: (right, down) => once(() => stepped(10, acts.moves.pan)(right, down)),
      isHandling: () => this.#handles !== null || isAwaited(),
      lift: (steps) => once(() => this.#handles?.step(0, 0, steps)),
    };
    watchGestures(this.root, this.move, () => ui.state.tool);
    watchToolbar(find("tools"));
    // The tools fade once a pointer has been there and is gone.
    this.root.parentElement.addEventListener("pointerleave", ({ target }) => target.classList.add("left"));
    const opener = find("open-tools");
    opener.addEventListener("click", () => this.#openTools(opener.ariaExpanded !== "true"));
    find("tools").addEventListener("click", ({ target }) => {
      const tool = target.closest("[data-tool]")?.dataset.tool;
      if (!tool) return;
      this.#openTools(false);
      ui.set({ tool });
      if (HANDLED.includes(tool)) this.root.focus(); // where the arrows are the tool's
    });
  }

  // The glass and the handles while they are in the hand, else null.
  get #glass() {
    const { inspector } = this.tools.now ?? {};
    return inspector?.active ? inspector : null;
  }

  get #handles() {
    const { handles } = this.tools.now ?? {};
    return handles?.isActive ? handles : null;
  }

  get aspect() {
    const { width, height } = this.viewport.canvas;
    return width / height;
  }

  // Where one button stands for the tools.
  #openTools(isOpen) {
    this.find("open-tools").setAttribute("aria-expanded", String(isOpen));
  }

  // Draws the final frame in the picture, by the sides of both.
  frameAs(final, picture) {
    const [ratio, frame] = [picture, final].map(({ width, height }) => width / height);
    this.#composed = Math.min(ratio, frame);
    this.root.style.setProperty("--ratio", String(ratio));
    this.root.style.setProperty("--frame", String(this.#composed));
  }

  // A quarter of what is seen: how large new things are.
  radius() {
    const { camera } = this.acts;
    const size = halfHeight(camera, axes(camera).distance) * 0.25;
    return Number(size.toPrecision(2));
  }

  showUi(state) {
    const { tool } = state;
    this.root.dataset.tool = tool;
    for (const button of this.find("tools").querySelectorAll("[data-tool]")) {
      const isHeld = button.dataset.tool === tool;
      button.setAttribute("aria-pressed", String(isHeld));
      if (isHeld) this.find("open-tools").replaceChildren(button.querySelector("svg").cloneNode(true));
    }
    if (tool !== "orbit" && !this.tools.now) this.tools.get().catch(this.complain);
    this.tools.now?.showUi(state);
    this.mark();
  }

  painted(frame) {
    this.#frame = frame;
    this.tools.now?.painted(frame);
    this.mark();
  }

  // Shows what lies over the picture where that belongs now.
  mark() {
    this.tools.now?.mark(this.aspect);
  }

  // The picture has another size.
  resized() {
    this.tools.now?.overlay();
    this.mark();
  }

  // Another picture is on its way.
  awaited() {
    this.tools.now?.inspector.forget();
  }

  // The stream begins anew: what was asked of its pictures may not hold any more.
  forget() {
    this.tools.now?.picker.forget();
  }

  async tap(x, y, isAlt) {
    const place = this.viewport.place(x, y);
    const { tool } = this.ui.state;
    if (!place || tool === "inspect") return;
    try {
      const tools = await this.tools.get();
      if (isAlt || tool === "highlight") await tools.placeHighlight(place, this.aspect);
      else if (tool === "focus") await tools.picks.focus(place, this.aspect);
      else await tools.picks.select(place);
    } catch (error) {
      this.complain(error instanceof NotReady ? new Error(EARLY[isAlt ? "highlight" : tool] ?? EARLY.select) : error);
    }
  }

  async #picks() {
    return (await this.tools.get()).picks;
  }

  // The index of the shape at a point of the page, or null.
  async shapeAt(x, y) {
    return (await this.#picks()).shapeAt(x, y);
  }

  // Outlines the shape that a hand is over, or null.
  async point(shape) {
    await (await this.#picks()).point(shape);
  }

  // Has shapeAt() answer at once.
  async prepare() {
    await (await this.#picks()).prepare();
  }

  // The box around each shape of the scene, or null where it is not known.
  async boxes() {
    return (await this.#picks()).boxes();
  }

  // As in light-there.js.
  async irradianceFor(shapes, toLight, exposure) {
    return (await this.tools.get()).irradianceFor(shapes, toLight, exposure);
  }

  // What of the camera has to change for a ball to fill the picture.
  framed(around) {
    return frame(this.acts.camera, around, this.#composed);
  }

  // Brings a thing into the middle; without one, everything that is not endless.
  async frame(thing = this.acts.state.chosen.thing) {
    await (await this.#picks()).frame(thing, (around) => this.framed(around));
  }
}
