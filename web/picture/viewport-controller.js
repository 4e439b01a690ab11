// The picture under the hand: tools, picking, framing, focus, and what lies over it.

import { ball, box, isFlat, together } from "../document/bounds.js";
import { axes, frame, ray } from "../document/camera.js";
import { lampsOf } from "../document/lamps.js";
import { AxisViews } from "./axis-views.js";
import { watchGestures } from "./gestures.js";
import { HANDLED, Handles } from "./handles.js";
import { placeHighlight } from "./highlight-tool.js";
import { Inspector } from "./inspector.js";
import { irradianceFor } from "./light-there.js";
import { Markers } from "./markers.js";
import { drawClipping, drawHistogram, fitGuides, showClipped, showLegend } from "./overlays.js";
import { Picker, drawOutline } from "../document/picking.js";
import { NotReady } from "../server/stream.js";
import { watchToolbar } from "../lib/tabs.js";
import { isOn } from "../document/outline.js";
import { at, pointer } from "../lib/patch.js";
import { dot } from "../lib/vector.js";
import { inWords } from "../lib/format-text.js";

// A click before there is a picture.
const EARLY = {
  focus: "Nothing can be focused on yet: the picture is still being prepared. Click again once it is there.",
  highlight: "Nothing can be mirrored yet: the picture is still being prepared. Click again once it is there.",
  select: "Nothing can be selected in the picture yet: it is still being prepared. The outline has everything.",
};

const BRIEF_MS = 1000; // that a new thing waits to learn from the picture what is in its way
const OVERLAY_MS = 200; // between two histograms
const LENS_SHARE = 0.02; // of the distance: what a pinhole opens to when somebody wants to focus

export class ViewportController {
  #outlined = {}; // what the outline was drawn of: it stays while that is so
  #overlaid = 0;
  #timer = null;

  // `find(id)` elements, `acts` the editor, `ui`, `stream`, `viewport`; `say(text)`, `complain(error)`.
  constructor(parts) {
    Object.assign(this, parts);
    const { find, stream, viewport, acts, ui } = parts;
    this.root = find("stage");
    this.picker = new Picker(stream);
    this.inspector = new Inspector(
      { stage: this.root, sheet: find("sheet"), probe: find("probe"), crosshair: find("crosshair") },
      viewport,
      stream,
    );
    this.markers = new Markers(find("markers"), acts, parts.say);
    this.axisViews = new AxisViews(find("axis-views"), acts, parts.say);
    this.handles = new Handles(find("handles"), {
      acts,
      tool: () => ui.state.tool,
      cloud: (shape) => this.picker.cloud(acts.state.scene, acts.camera, shape),
      say: parts.say,
    });
    this.move = {
      ...acts.moves,
      zoom: (factor, x, y) =>
        this.inspector.active ? this.inspector.magnify(1 / factor, x, y) : acts.moves.zoom(factor),
      slide: (right, down) => this.inspector.slide(right, down),
      hover: (x, y) => {
        if (this.inspector.active) this.inspector.hover(x, y);
      },
      tap: (x, y, isAlt) => this.tap(x, y, isAlt),
    };
    // The arrows move the cross, or change the selection, where that is the tool.
    const stepped = (steps, orElse) => (right, down) => {
      if (this.inspector.active) this.inspector.step(steps * Math.sign(right), steps * Math.sign(down));
      else if (this.handles.isActive) this.handles.step(steps * Math.sign(right), -steps * Math.sign(down), 0);
      else orElse(right, down);
    };
    this.keyMove = {
      ...this.move,
      orbit: stepped(1, acts.moves.orbit),
      pan: stepped(10, acts.moves.pan),
      isHandling: () => this.handles.isActive,
      lift: (steps) => this.handles.step(0, 0, steps),
    };
    watchGestures(this.root, this.move, () => ui.state.tool);
    watchToolbar(find("tools"));
    find("tools").addEventListener("click", ({ target }) => {
      const tool = target.closest("[data-tool]")?.dataset.tool;
      if (!tool) return;
      ui.set({ tool });
      if (HANDLED.includes(tool)) this.root.focus(); // where the arrows are the tool's
    });
  }

  get aspect() {
    const { width, height } = this.viewport.canvas;
    return width / height;
  }

  // A quarter of what is seen: how large new things are.
  radius() {
    const { camera } = this.acts;
    const size = axes(camera).distance * Math.tan((camera.vfov * Math.PI) / 360) * 0.25;
    return Number(size.toPrecision(2));
  }

  showUi({ tool, guides, clipping, histogram }) {
    this.root.dataset.tool = tool;
    for (const button of this.find("tools").querySelectorAll("[data-tool]"))
      button.setAttribute("aria-pressed", String(button.dataset.tool === tool));
    this.inspector.toggle(tool === "inspect");
    this.find("guides").hidden = !guides;
    this.find("clipping").hidden = !clipping;
    this.find("clipped").hidden = !clipping;
    this.find("histogram").hidden = !histogram;
    this.overlay();
    this.mark();
  }

  painted({ legend }) {
    showLegend(this.find("legend"), legend);
    this.inspector.refresh();
    this.overlay();
    this.mark();
  }

  // Where lights are, while one of these, the environment or the camera is selected and no material is looked at.
  mark() {
    const { scene, chosen } = this.acts.state;
    const { camera, shapes, thing } = this.#outlined;
    if (scene.camera !== camera || scene.shapes !== shapes || chosen.thing !== thing)
      this.find("outline").classList.remove("shown");
    const { tool, target } = this.ui.state;
    const isLight = lampsOf(scene).some(({ thing }) => thing === chosen.thing);
    const isOn = (isLight || /^\/(camera|environment)/.test(chosen.thing)) && tool !== "inspect";
    const tall = fitGuides(this.find("markers"), this.root, this.viewport.canvas);
    this.markers.show(isOn, this.aspect, tall, target);
    const height = fitGuides(this.find("handles"), this.root, this.viewport.canvas);
    this.axisViews.show();
    this.handles.show(HANDLED.includes(tool), this.aspect, height);
  }

  // Histogram and clipping follow the picture at their own pace.
  overlay() {
    const { histogram, clipping, guides } = this.ui.state;
    if (guides) fitGuides(this.find("guides"), this.root, this.viewport.canvas);
    if ((!histogram && !clipping) || this.#timer) return;
    this.#timer = setTimeout(
      () => {
        this.#timer = null;
        this.#overlaid = performance.now();
        const image = this.viewport.pixels();
        if (histogram) drawHistogram(this.find("histogram"), image);
        if (clipping) showClipped(this.find("clipped"), drawClipping(this.find("clipping"), image));
      },
      Math.max(0, this.#overlaid + OVERLAY_MS - performance.now()),
    );
  }

  async tap(x, y, isAlt) {
    const place = this.viewport.place(x, y);
    const { tool } = this.ui.state;
    if (!place || tool === "inspect") return;
    try {
      if (isAlt || tool === "highlight") await placeHighlight(this, place, this.aspect);
      else if (tool === "focus") await this.focus(place);
      else await this.select(place);
    } catch (error) {
      this.complain(error instanceof NotReady ? new Error(EARLY[isAlt ? "highlight" : tool] ?? EARLY.select) : error);
    }
  }

  async shapeAt(x, y) {
    const place = this.viewport.place(x, y);
    return place && this.picker.shape(this.acts.steady.scene, place);
  }

  async select(place) {
    const { scene } = this.acts.state;
    const shape = await this.picker.shape(scene, place);
    if (shape === null || !scene.shapes[shape]) {
      this.acts.select("/environment");
      return this.say("Environment selected");
    }
    if (isOn(this.acts.state, "locked", [pointer("shapes", shape)])) return this.say("It is locked");
    this.acts.select(pointer("shapes", shape));
    this.say(`${inWords(scene.shapes[shape].material)} selected`);
    drawOutline(
      this.find("outline"),
      await this.picker.layer("shape_id", scene),
      shape,
      getComputedStyle(this.root).getPropertyValue("--accent-bright"),
    );
    const { camera, shapes } = scene;
    this.#outlined = { camera, shapes, thing: this.acts.state.chosen.thing };
    this.find("outline").classList.add("shown");
    this.mark();
  }

  async focus(place) {
    const { camera } = this.acts;
    const far = await this.picker.depth(this.acts.state.scene, place);
    if (!(far > 0)) return this.say("Nothing there to focus on");
    const along = far * dot(ray(camera, place.x, place.y, this.aspect), axes(camera).forward);
    const lens = camera.aperture_radius > 0 ? {} : { aperture_radius: Number((along * LENS_SHARE).toPrecision(2)) };
    this.acts.setCamera({ focus_distance: Number(along.toPrecision(4)), ...lens });
    this.say(`Focus at ${along.toPrecision(3)} metres${lens.aperture_radius ? ", aperture opened" : ""}`);
  }

  // The box around each shape of the scene: what the document tells, else what is seen of it, else null.
  async boxes() {
    const { scene } = this.acts.state;
    const known = scene.shapes.map(box);
    if (known.every(Boolean)) return known;
    const seen = await this.picker.boxes(scene, this.acts.camera, BRIEF_MS).catch(() => new Map());
    return known.map((each, i) => each ?? seen.get(i) ?? null);
  }

  // As in light-there.js.
  irradianceFor(shapes, toLight, exposure) {
    return irradianceFor(this.stream, shapes, toLight, exposure);
  }

  // What of the camera has to change for a ball to fill the picture.
  framed(around) {
    return frame(this.acts.camera, around, this.aspect);
  }

  // Brings a thing into the middle; without one, everything that is not endless.
  async frame(thing = this.acts.state.chosen.thing) {
    const { scene } = this.acts.state;
    const shape = thing.startsWith("/shapes/") ? at(scene, thing) : null;
    try {
      const around = shape
        ? (ball(shape) ?? (await this.picker.ball(scene, this.acts.camera, Number(thing.split("/")[2]))))
        : together(
            scene.shapes
              .filter((shape) => !isFlat(shape))
              .map(ball)
              .filter(Boolean),
          );
      if (around?.radius > 0) this.acts.setCamera(this.framed(around));
      else this.say("It can't be seen from here");
    } catch (error) {
      this.complain(error);
    }
  }
}
