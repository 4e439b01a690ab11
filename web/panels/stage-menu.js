// What things stand on: nothing, a ground or a cyclorama, of which colour; and a turntable, on which the live picture is
// seen from all round.

import { isStage, stageOf } from "../document/stage.js";
import { hex, linear } from "../lib/color.js";
import { element } from "../lib/dom.js";
import { watchMenu } from "../lib/menu.js";
import { pointer } from "../lib/patch.js";
import { fields, materialModels } from "../server/schema.js";
import { Turntable } from "../picture/turntable.js";

const KINDS = { none: "None", ground: "Ground", cyclorama: "Cyclorama" };

export class StageMenu {
  // `find(id)` elements; `acts` the editor, `put(kind)` has all things stand on that, `schema` is the scene's; `turning` is
  // what Turntable is made of.
  constructor(find, { acts, put, schema, turning, say }) {
    Object.assign(this, { acts, put, schema });
    const root = find("stage-menu");
    this.turntable = new Turntable({ ...turning, acts, ended: () => this.show() });
    this.kinds = Object.entries(KINDS).map(([value, title]) => {
      const input = element("input", { type: "radio", name: "stage", value, onchange: () => this.#pick(value) });
      return { input, label: element("label", {}, input, title) };
    });
    this.color = element("input", {
      type: "color",
      id: "stage-color",
      oninput: () =>
        acts.edit(
          this.#paint.place,
          linear(this.color.value).map((x) => Number(x.toPrecision(4))),
        ),
      onchange: () => acts.endGesture(),
    });
    this.colorRow = element(
      "div",
      { class: "field whole" },
      element("label", { for: "stage-color" }, "Backdrop colour"),
      this.color,
    );
    this.toggle = element("input", {
      type: "checkbox",
      class: "toggle",
      onchange: () => {
        if (this.toggle.checked) this.turntable.start();
        else this.turntable.stop();
        say(this.toggle.checked ? "The turntable turns" : "The turntable stands still");
      },
    });
    this.note = element("p", { class: "note" });
    root.append(
      element(
        "div",
        { class: "checks stages", role: "radiogroup", "aria-label": "Stage" },
        ...this.kinds.map(({ label }) => label),
      ),
      this.colorRow,
      element("div", { class: "checks" }, element("label", {}, this.toggle, "Turntable")),
      this.note,
    );
    acts.subscribe(() => this.show());
    this.show();
    watchMenu(find("stage-button"), root);
  }

  async #pick(kind) {
    await this.put(kind);
    this.show(); // what there is, also where that failed
  }

  // {place, value} of the colour of the stage's material, or null.
  get #paint() {
    const { scene } = this.acts.state;
    const name = scene.shapes.find(isStage)?.material;
    const material = scene.materials[name];
    if (!material) return null;
    const own = fields(this.schema, materialModels(this.schema)[material.type]);
    const field = own.find(({ widget, takesTexture }) => widget === "color" && takesTexture);
    return field && { place: pointer("scene", "materials", name, field.name), value: material[field.name] };
  }

  show() {
    const { scene } = this.acts.state;
    const kind = stageOf(scene);
    for (const { input } of this.kinds) input.checked = input.value === kind;
    const paint = this.#paint;
    const isTextured = Boolean(paint?.value?.texture);
    this.colorRow.hidden = !paint;
    this.color.disabled = isTextured;
    if (paint && !isTextured) this.color.value = hex(linear(paint.value ?? 1));
    const { isPossible } = this.turntable;
    this.toggle.checked = this.turntable.isTurning;
    this.toggle.disabled = !isPossible;
    this.note.textContent = isPossible ? "" : "The turntable stands still, as this system asks for less motion.";
  }
}
