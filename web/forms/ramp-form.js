// What a ramp reads, and its stops.

import { hex, linear } from "../lib/color.js";
import { element, freshId } from "../lib/dom.js";
import { at, isObject, pointer } from "../lib/patch.js";
import { inWords } from "../lib/format-text.js";
import { fresh } from "../document/materials.js";
import { fields, property, textureModel, variants } from "../server/schema.js";

const OTHER = "texture:";
const NOISE = "new noise";

// The colours from the first position to the last, as CSS.
function gradient({ stops, interpolation }) {
  const sorted = stops.toSorted((a, b) => a.position - b.position);
  const marks = sorted.map(({ position, color }, i) => {
    const from = `${hex(linear(color))} ${position * 100}%`;
    return interpolation === "constant" && sorted[i + 1] ? `${from} ${sorted[i + 1].position * 100}%` : from;
  });
  return `linear-gradient(to right in srgb-linear, ${marks.join(", ")})`;
}

export class RampForm {
  #count = 0;
  #stops = [];
  #inner = null; // {key, element, place, show}: the form of the texture that is read

  // `place` of the ramp in the editor's state; `part(model, place)` makes a form.
  constructor({ schema, place, acts, part }) {
    Object.assign(this, { schema, place, acts, part });
    this.model = textureModel(schema, { type: "ramp" });
    this.stop = property(schema, this.model, "stops");
    const id = freshId("input");
    this.input = element("select", { id, onchange: () => this.#choose(this.input.value) });
    this.within = element("div", {});
    this.bar = element("div", { class: "ramp", "aria-hidden": "true" });
    this.list = element("div", { class: "stops-list" });
    this.more = element(
      "button",
      { type: "button", class: "button small", onclick: () => this.#add() },
      "Add a stop",
    );
    this.element = element(
      "div",
      {},
      element("div", { class: "field" }, element("label", { for: id }, "Input"), this.input),
      this.within,
      this.bar,
      this.list,
      this.more,
    );
  }

  get #ramp() {
    return at(this.acts.state, this.place);
  }

  #give(name, value) {
    this.acts.edit(`${this.place}/${name}`, value);
    this.acts.endGesture();
  }

  #choose(value) {
    if (value === NOISE) {
      const { scene } = this.acts.state;
      const name = fresh("noise", scene.textures);
      const ramp = { ...this.#ramp, input: { texture: name } };
      const own = this.place.split("/").at(-1).replaceAll("~1", "/").replaceAll("~0", "~");
      this.acts.change({
        scene: { ...scene, textures: { ...scene.textures, [name]: { type: "noise" }, [own]: ramp } },
      });
    } else this.#give("input", value.startsWith(OTHER) ? { texture: value.slice(OTHER.length) } : value);
  }

  // Between the two stops that are farthest apart.
  #add() {
    const stops = [...this.#ramp.stops].sort((a, b) => a.position - b.position);
    const gaps = stops.slice(1).map(({ position }, i) => position - stops[i].position);
    const i = gaps.indexOf(Math.max(...gaps));
    const position = Number(((stops[i].position + stops[i + 1].position) / 2).toPrecision(3));
    this.#give("stops", [...stops.slice(0, i + 1), { ...stops[i], position }, ...stops.slice(i + 1)]);
  }

  #row(i) {
    const model = this.stop.items;
    const form = this.part(model, `${this.place}/stops/${i}`);
    const remove = element(
      "button",
      {
        type: "button",
        class: "forget",
        "aria-label": `Remove stop ${i + 1}`,
        onclick: () =>
          this.#give(
            "stops",
            this.#ramp.stops.filter((_, k) => k !== i),
          ),
      },
      "×",
    );
    const row = element("div", { class: "stop", role: "group", "aria-label": `Stop ${i + 1}` }, form.element, remove);
    return { ...form, element: row, remove };
  }

  #showInput({ input = property(this.schema, this.model, "input").default }) {
    const { textures = {} } = this.acts.state.scene;
    const field = fields(this.schema, this.model).find(({ name }) => name === "input");
    const others = Object.keys(textures).filter((name) => textures[name].type !== "ramp");
    const offered = [
      ...field.choices.map((value) => [value, inWords(value)]),
      ...others.map((name) => [OTHER + name, name]),
      [NOISE, "New noise"],
    ];
    this.input.replaceChildren(...offered.map(([value, text]) => element("option", { value }, text)));
    this.input.value = isObject(input) ? OTHER + input.texture : input;
    const name = isObject(input) ? input.texture : null;
    const key = name === null ? null : JSON.stringify([name, textures[name]?.type]);
    if (key !== (this.#inner?.key ?? null)) {
      const place = name === null ? null : pointer("scene", "textures", name);
      this.#inner =
        name === null ? null : { key, place, ...this.part(textureModel(this.schema, textures[name]), place) };
      this.within.replaceChildren(...(this.#inner ? [this.#inner.element] : []));
    }
    if (this.#inner) this.#inner.show(at(this.acts.state, this.#inner.place) ?? {});
  }

  // The forms inside, each with its place.
  get parts() {
    return [this.#inner, ...this.#stops].filter(Boolean);
  }

  // A ramp's document.
  show(ramp) {
    if (!ramp.stops) return; // it was taken away just now
    this.#showInput(ramp);
    if (ramp.stops.length !== this.#count) {
      this.#count = ramp.stops.length;
      this.#stops = ramp.stops.map((_, i) => this.#row(i));
      this.list.replaceChildren(...this.#stops.map((row) => row.element));
    }
    this.#stops.forEach((row, i) => {
      row.show(ramp.stops[i]);
      row.remove.disabled = ramp.stops.length <= this.stop.minItems;
    });
    this.bar.style.background = gradient(ramp);
    this.more.disabled = ramp.stops.length >= this.stop.maxItems;
  }
}
