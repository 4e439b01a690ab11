// The tools over the picture: the glass, marks of lights, handles, views along the axes; and what is laid over it.

import { AxisViews } from "./axis-views.js";
import { Handles } from "./handles.js";
import { Inspector } from "./inspector.js";
import { Markers } from "./markers.js";
import { Picks } from "./picks.js";
import { fitOverlay, showLegend } from "./overlays.js";
import { HANDLED } from "../document/ui-state.js";
import { lampsOf } from "../document/lamps.js";
import { Paced } from "../lib/paced.js";

const OVERLAY_MS = 200; // between two histograms

export class Tools {
  #overlays = new Paced(OVERLAY_MS, () => this.#drawOverlays());

  // As ViewportController has them: `find(id)` elements, `acts` the editor, `ui`, `stream`, `viewport`; `say(text)`,
  // `complain(error)`.
  constructor({ find, acts, ui, stream, viewport, say, complain }) {
    Object.assign(this, { find, acts, ui, stream, viewport, say });
    this.picks = new Picks({ find, acts, stream, viewport, say, complain });
    this.picker = this.picks.picker;
    this.root = find("stage");
    this.inspector = new Inspector(
      { stage: this.root, sheet: find("sheet"), probe: find("probe"), crosshair: find("crosshair") },
      viewport,
      stream,
    );
    this.markers = new Markers(find("markers"), acts, say);
    this.axisViews = new AxisViews(find("axis-views"), acts, say);
    this.handles = new Handles(find("handles"), {
      acts,
      tool: () => ui.state.tool,
      cloud: (shape) => this.picker.cloud(acts.state.scene, acts.camera, shape),
      say,
    });
  }

  showUi({ tool, guides, clipping, histogram }) {
    this.inspector.toggle(tool === "inspect");
    this.find("guides").hidden = !guides;
    this.find("clipping").hidden = !clipping;
    this.find("clipped").hidden = !clipping;
    this.find("histogram").hidden = !histogram;
    this.overlay();
  }

  painted({ legend }) {
    showLegend(this.find("legend"), legend);
    this.inspector.refresh();
    this.overlay();
  }

  // Where lights are, while one of these, the environment or the camera is selected and no material is looked at, or the
  // tool is one for lights.
  mark(aspect) {
    this.picks.mark();
    const { scene, chosen } = this.acts.state;
    const { tool, target } = this.ui.state;
    const isLight = lampsOf(scene).some(({ thing }) => thing === chosen.thing);
    const isOn =
      tool === "highlight" || ((isLight || /^\/(camera|environment)/.test(chosen.thing)) && tool !== "inspect");
    const tall = fitOverlay(this.find("markers"), this.root, this.viewport.canvas);
    this.markers.show(isOn, aspect, tall, target);
    const height = fitOverlay(this.find("handles"), this.root, this.viewport.canvas);
    this.axisViews.show();
    this.handles.show(HANDLED.includes(tool), aspect, height);
  }

  // Histogram and clipping follow the picture at their own pace.
  overlay() {
    const { histogram, clipping } = this.ui.state;
    if (histogram || clipping) this.#overlays.ask();
  }

  async #drawOverlays() {
    const { drawClipping, drawHistogram, showClipped } = await import("./histogram.js");
    const { histogram, clipping } = this.ui.state;
    const image = this.viewport.pixels();
    if (histogram) drawHistogram(this.find("histogram"), image);
    if (clipping) showClipped(this.find("clipped"), drawClipping(this.find("clipping"), image));
  }

  async placeHighlight(place, aspect) {
    const { placeHighlight } = await import("./highlight-tool.js");
    return placeHighlight(this, place, aspect);
  }

  // As in light-there.js.
  async irradianceFor(shapes, toLight, exposure) {
    const { irradianceFor } = await import("./light-there.js");
    return irradianceFor(this.stream, shapes, toLight, exposure);
  }
}
