// The bar of a comparison, above the picture: what stands at its sides, how both are compared, and what is found.

import { element } from "../lib/dom.js";
import { browse } from "../lib/files.js";
import { inWords } from "../lib/format-text.js";
import { watchChoice } from "../lib/tabs.js";
import { ASKED, GAINS, MODES, PHOTO, gainOf, modeOf, shows, sidesOf } from "../document/variants.js";
import { Choices } from "./choices.js";
import { NEUTRAL } from "./photograph.js";

const PICTURES = ".png,.jpg,.jpeg,.webp,.avif";
const WHY_NOT = "A photograph's noise is not known, so there is neither a verdict nor FLIP with one.";

// What is set by hand of a photograph, in stops: [name, title, most to either side, what its ends do].
const STOPS = [
  ["exposure", "Exposure", 6, "Stops, in linear light"],
  ["temperature", "Temperature", 2, "Cold to warm: stops of red against blue, in linear light"],
  ["tint", "Tint", 1, "Green to magenta: stops, in linear light"],
];

const select = (label, change, ...options) =>
  element("select", { "aria-label": label, onchange: ({ target }) => change(target.value) }, ...options);
const option = (value, title) => element("option", { value: String(value) }, title);
const button = (label, does, more = {}) =>
  element("button", { type: "button", class: "button small", onclick: does, ...more }, label);

export class CompareBar {
  // `acts` is the editor; `models` are those that B can be turned into; `choose(members)` of what is compared,
  // `place(side, name)`, `ask()` the server or stop that; `takePhoto(file)`, `setPhoto(stops)`.
  constructor(root, { acts, models, choose, place, ask, takePhoto, setPhoto }) {
    this.root = root;
    this.left = select("Left", (name) => place("left", name));
    this.right = select("Right", (name) => place("right", name));
    this.choices = new Choices({ left: this.left, right: this.right });
    this.modes = select(
      "Comparison",
      (mode) => choose({ mode }),
      ...Object.entries(MODES).map(([value, title]) => option(value, title)),
    );
    this.signs = select(
      "Sign of the difference",
      (sign) => choose({ isSigned: sign === "signed" }),
      option("absolute", "Absolute"),
      option("signed", "Signed"),
    );
    this.signs.title = "Signed: brighter than grey where the right is brighter";
    this.gains = select(
      "How much the difference is brightened",
      (gain) => choose({ gain: Number(gain) }),
      ...GAINS.map((gain) => option(gain, `×${gain}`)),
    );
    this.asks = button("Ask again", ask, { class: "button small asks" });
    const close = button("Done", () => acts.stopComparing(), { class: "button small close" });
    this.metric = element("p", { class: "metric", role: "status", "aria-label": "Verdict" });
    root.append(
      element(
        "div",
        { class: "compare-top" },
        element(
          "div",
          { class: "compare-row" },
          this.left,
          this.right,
          this.modes,
          this.signs,
          this.gains,
          this.asks,
          this.#variants(acts, models),
        ),
        close,
      ),
      this.#photo(takePhoto, setPhoto),
      this.metric,
    );
  }

  // What is done with the variants, where B is at a side.
  #variants(acts, models) {
    const radio = (name, title) =>
      element("button", { type: "button", role: "radio", class: "button small", "data-value": name }, title);
    const sides = element(
      "div",
      { class: "cluster", role: "radiogroup", "aria-label": "Which variant is edited" },
      element("span", { class: "note" }, "Edit"),
      radio("a", "A"),
      radio("b", "B"),
    );
    this.markSide = watchChoice(sides, "button", ({ dataset }) => acts.editSide(dataset.value));
    const turn = select(
      "Turn variant B into another model",
      (model) => {
        if (model) acts.pickVariant(model);
        turn.value = "";
      },
      option("", "B as…"),
      ...models.map((name) => option(name, inWords(name))),
    );
    this.variants = element(
      "div",
      { class: "of-variants" },
      sides,
      turn,
      button("Swap", () => acts.swapVariants()),
      button("Discard B", () => acts.discardB(), { title: "Throws variant B away; Done keeps it" }),
    );
    return this.variants;
  }

  // The photograph's file, and what is set of it by hand.
  #photo(takePhoto, setPhoto) {
    const stops = () => Object.fromEntries(this.stops.map(({ name, range }) => [name, range.valueAsNumber]));
    this.stops = STOPS.map(([name, title, most, words]) => {
      const label = `Photograph: ${title.toLowerCase()}`;
      const range = element("input", {
        type: "range",
        min: String(-most),
        max: String(most),
        step: "0.05",
        value: "0",
        "aria-label": label,
        oninput: () => setPhoto(stops()),
      });
      const reading = element("output", { class: "unit" });
      return {
        name,
        range,
        reading,
        element: element("label", { title: words }, element("span", {}, title), range, reading),
      };
    });
    this.file = button("Choose a photograph…", async () => {
      const [file] = await browse(PICTURES);
      if (file) takePhoto(file);
    });
    this.photo = element(
      "div",
      { class: "of-photo", role: "group", "aria-label": "Photograph" },
      this.file,
      ...this.stops.map((each) => each.element),
      button("Neutral", () => setPhoto(NEUTRAL)),
      element("p", { class: "note" }, WHY_NOT),
    );
    return this.photo;
  }

  // `photograph` or null; `isAsking`: whether the server is asked.
  show(compare, { photograph, isAsking }) {
    const names = sidesOf(compare);
    const mode = modeOf(compare);
    const isPhoto = shows(compare, PHOTO);
    this.choices.show(names, photograph?.name ?? "Photograph…");
    this.modes.value = mode;
    for (const each of this.modes.options) each.disabled = isPhoto && ASKED.includes(each.value);
    this.signs.hidden = mode !== "difference";
    this.signs.value = compare.isSigned ? "signed" : "absolute";
    this.gains.hidden = !["difference", "heat"].includes(mode);
    this.gains.value = String(gainOf(compare));
    this.asks.hidden = !ASKED.includes(mode);
    this.asks.textContent = isAsking ? "Stop" : "Ask again";
    this.variants.hidden = !shows(compare, "b");
    this.markSide(({ dataset }) => dataset.value === compare.side);
    this.photo.hidden = !isPhoto;
    for (const { name, range, reading } of this.stops) {
      const value = photograph?.stops[name] ?? 0;
      if (range.valueAsNumber !== value) range.value = String(value);
      range.disabled = !photograph;
      const { min, max } = range;
      range.style.setProperty("--share", String((value - min) / (max - min)));
      reading.textContent = `${value > 0 ? "+" : ""}${Number(value.toFixed(2))}`;
      range.setAttribute("aria-valuetext", `${value} stops`);
    }
  }

  // One line, and beside it what matters less. `isSpoken`: to those who cannot see it, too.
  tell(text, beside = "", isSpoken = false) {
    const live = isSpoken ? "polite" : "off"; // figures that follow the samples would never be silent
    if (this.metric.ariaLive !== live) this.metric.ariaLive = live;
    const whole = [text, beside].filter(Boolean).join(" · ");
    if (this.metric.title === whole) return;
    this.metric.title = whole;
    this.metric.replaceChildren(
      element("b", {}, text),
      element("span", { class: "beside" }, beside && ` · ${beside}`),
    );
  }
}
