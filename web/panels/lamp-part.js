// The form of the selected lamp, in a photographer's words: colour, power, size, distance, softness.

import * as lamp from "../document/lamp-light.js";
import { LIGHTS } from "../document/lights.js";
import { amount } from "../forms/amounts.js";
import { strengthControl } from "../forms/controls.js";
import { schemaForm } from "../forms/schema-form.js";
import { temperature } from "../forms/temperature.js";
import { linear } from "../lib/color.js";
import { element } from "../lib/dom.js";
import { compact } from "../lib/format-text.js";
import { parseNumber } from "../lib/number.js";
import { at } from "../lib/patch.js";
import { fields, materialModels } from "../server/schema.js";

const PLAIN = { hint: "", unit: "", open: {}, soft: {}, step: 0.01, required: true };
const lengthField = (name, title, hint, [min, max]) => ({
  ...PLAIN,
  name,
  title,
  hint,
  make: amount,
  widget: "amount",
  unit: "m",
  min: 0,
  open: { min: 0 },
  soft: { min, max },
  log: min,
});
const KEEPS = "What it shines at stays as bright.";
const HINTS = {
  temperature: "Low is warm, high is cool. Its brightness stays.",
  power: "Each stop is twice the light.",
  size: `Larger is softer. ${KEEPS}`,
  distance: "From the middle of what it shines at, along the line to there. Nearer is brighter, and softer.",
  softness: `Its size over its distance: 0.1 is hard, 1 very soft. It changes the size. ${KEEPS}`,
  shared:
    "Other things shine with its material: its colour and power are theirs too, and it gets brighter as it grows.",
};
const UNITS = { lm: "lm", cd: "cd", lx: "lx", nt: "cd/m²" };

export class LampPart {
  #made = null; // what the form was made for
  #form = null;
  #held = null; // {scene, stand}: before the hand began

  // `root` is its place on the page; `schema` of the scene; `acts` the editor.
  constructor(root, { schema, acts }) {
    Object.assign(this, { root, schema, acts });
    this.figures = element("p", { class: "note figures" });
    this.note = element("p", { class: "note" });
  }

  // `thing`: the selected lamp, with its model `owner` of the schema; null where none is.
  show(scene, { thing, owner }) {
    this.thing = thing;
    this.root.hidden = !thing;
    if (!thing) {
      this.#made = null;
      return;
    }
    const document = at(scene, thing);
    const stand = lamp.standing(scene, document, this.acts.camera);
    const kind = [thing, document.type, Boolean(stand)].join(" ");
    if (kind !== this.#made) this.#make(kind, document, owner, stand);
    this.#form.show(this.#values(scene, document, stand));
    const brightness = lamp.power(lamp.lightOf(scene, document));
    this.figures.textContent = Object.entries(lamp.photometry(scene, document))
      .map(([unit, factor]) => `${inThousands(brightness * factor)} ${UNITS[unit]}`)
      .join(" · ");
    const isShared = lamp.isShared(scene, document);
    this.note.hidden = !isShared && !LIGHTS[document.type]?.isSharp;
    this.note.textContent = isShared ? HINTS.shared : "It has no size: its shadows are sharp.";
  }

  #values(scene, document, stand) {
    const rgb = lamp.lightOf(scene, document);
    const sizes = Object.fromEntries(lamp.sizesOf(document).map(({ name, value }) => [name, value]));
    return {
      ...document,
      temperature: rgb,
      power: lamp.power(rgb),
      ...sizes,
      ...(stand ? { distance: stand.distance } : {}),
      ...(stand && Object.keys(sizes).length ? { softness: lamp.softness(document, stand) } : {}),
    };
  }

  #make(kind, document, owner, stand) {
    this.#made = kind;
    this.#held = null;
    const own = fields(this.schema, owner);
    const sizes = lamp.sizesOf(document);
    const angles = own.filter(({ unit }) => unit === "degrees");
    const all = [
      { ...PLAIN, name: "temperature", title: "Colour temperature", hint: HINTS.temperature, make: temperature },
      this.#power(document, own),
      ...sizes.map(({ name, title }) => lengthField(name, title, HINTS.size, [0.01, 10])),
      ...(stand ? [lengthField("distance", "Distance", HINTS.distance, [0.1, 20])] : []),
      ...(stand && sizes.length ? [softnessField()] : []),
      ...angles.map((field) => ({
        ...field,
        required: true, // its own form has no way back
        ...(field.name === "angular_diameter" ? { title: "Softness" } : {}),
      })),
    ];
    this.#form = schemaForm(all, {
      change: (name, value) => this.#change(name, value),
      commit: () => {
        this.#held = null;
        this.acts.endGesture();
      },
      forgive: () => this.acts.forgive(),
    });
    this.#form.element.querySelector("[data-field=power]").append(this.figures);
    this.root.replaceChildren(this.#form.element, this.note);
  }

  // The field of its strength: of a light its own, of a shape that of its material.
  #power(document, own) {
    const name = lamp.strengthName(document);
    const { scene } = this.acts.state;
    const material = materialModels(this.schema)[scene.materials[document.material]?.type];
    const found = own.find((field) => field.name === name) ?? fields(this.schema, material).find(isEmission);
    const unit = found.name === "emission_luminance" ? "W/(m^2 sr)" : found.unit;
    const read = (text) => {
      const [, number, sign] = /^(.*?)\s*(lm|cd|lx|nt|lumen|candela|lux|nits?)$/i.exec(text.trim()) ?? [];
      const short = { lumen: "lm", candela: "cd", lux: "lx", nit: "nt", nits: "nt" }[sign?.toLowerCase()] ?? sign;
      const factor = short && lamp.photometry(this.acts.state.scene, at(this.acts.state.scene, this.thing))[short];
      if (!short) return parseNumber(text, unit);
      const value = parseNumber(number);
      return factor && value !== null ? value / factor : null;
    };
    const title = `Power: ${found.title}`;
    return {
      ...found,
      unit,
      name: "power",
      group: undefined,
      title: "Power",
      hint: HINTS.power,
      required: true,
      takesTexture: false,
      make: (field, id, events) => strengthControl({ ...field, title, read }, id, events),
    };
  }

  #change(name, value) {
    const { acts, thing } = this;
    const now = acts.state.scene;
    this.#held ??= { scene: now, stand: lamp.standing(now, at(now, thing), acts.camera) };
    const { scene, stand } = this.#held;
    acts.forgive();
    acts.change({ scene: this.#changed(scene, stand, name, value) }, `lamp ${thing} ${name}`);
  }

  #changed(scene, stand, name, value) {
    const { thing } = this;
    const rgb = lamp.lightOf(scene, at(scene, thing));
    if (name === "temperature")
      return lamp.withLight(
        scene,
        thing,
        lamp.tinted(rgb, typeof value === "number" ? linear({ kelvin: value }) : value),
      );
    if (name === "power") {
      const before = lamp.power(rgb);
      return lamp.withLight(
        scene,
        thing,
        before > 0 ? rgb.map((x) => (x * (value ?? 0)) / before) : [value, value, value],
      );
    }
    if (name === "distance") return lamp.withDistance(scene, thing, stand, value);
    if (name === "softness") return lamp.withSoftness(scene, thing, stand, value);
    if (lamp.sizesOf(at(scene, thing)).some((size) => size.name === name))
      return lamp.withSize(scene, thing, name, value);
    return lamp.withField(scene, thing, name, value);
  }

  // As Panel.mark: the control's place, or null.
  mark(wrong, text) {
    if (!this.thing || !this.#form) return null;
    const { scene } = this.acts.state;
    const document = at(scene, this.thing);
    const place = `/scene${this.thing}/`;
    const name = wrong.startsWith(place) ? wrong.slice(place.length).split("/")[0] : null;
    if (name === null) return null;
    if (name === lamp.strengthName(document)) return this.#form.mark("power", text) ? `${place}${name}` : null;
    return this.#form.mark(name, text) ? `${place}${name}` : null;
  }

  forgive() {
    this.#form?.forgive();
  }
}

const isEmission = ({ name }) => name === "emission" || name === "emission_luminance";

function softnessField() {
  const write = (value) => `${compact(Number(value.toPrecision(2)))}, ${lamp.softnessWords(value)}`;
  const read = (text) => parseNumber(text.replace(/,?\s*(hard|medium|soft)\s*$/, ""));
  return {
    ...PLAIN,
    name: "softness",
    title: "Softness",
    hint: HINTS.softness,
    make: amount,
    min: 0,
    open: { min: 0 },
    soft: { min: 0.02, max: 2 },
    log: 0.02,
    write,
    read,
    needed: "A number is needed here, such as 0.5.",
  };
}

// 523400 -> "523 000", in three digits that count.
function inThousands(value) {
  const rounded = Number(value.toPrecision(3));
  return rounded < 1e4 ? String(rounded) : rounded.toLocaleString("en").replaceAll(",", "\u202f");
}
