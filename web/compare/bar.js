// The bar of a comparison, one row over the picture's head: what stands at its sides, how both are compared, and what
// can be done with them; and what is found.

import { element, freshId } from "../lib/dom.js";
import { browse } from "../lib/files.js";
import { inWords } from "../lib/format-text.js";
import { drawn } from "../lib/icon.js";
import { watchChoice } from "../lib/tabs.js";
import { ASKED, GAINS, MODES, PHOTO, gainOf, modeOf, shows, sidesOf } from "../document/variants.js";
import { Choices } from "./choices.js";
import { NEUTRAL } from "./photograph.js";

const PICTURES = ".png,.jpg,.jpeg,.webp,.avif";
const WHY_NOT = "There is no verdict and no FLIP with a photograph, as nobody knows its noise.";

// What is set by hand of a photograph, in stops: [name, title, most to either side, what its ends do].
const STOPS = [
  ["exposure", "Exposure", 6, "Brighter or darker, in stops"],
  ["temperature", "Temperature", 2, "Colder or warmer, in stops"],
  ["tint", "Tint", 1, "Greener or more magenta, in stops"],
];

// Of each way to compare.
const OUTLINES = {
  swipe: "M1.5 2.5h13v11h-13zM3 4v8h5V4z",
  beside: "M1.5 3h5.8v10H1.5zM8.7 3h5.8v10H8.7z",
  difference:
    "M5.8 3.2a4.8 4.8 0 1 1 0 9.600 4.800 4.800 0 0 1 0-9.600M10.200 3.200a4.800 4.800 0 1 1 0 9.600 4.800 4.800 0 0 1 0-9.600",
  heat: "M8.3 1.200c.5 2.800 4.100 4.300 4.100 8.200a4.400 4.400 0 0 1-8.800 0c0-1.900 1-3.100 2-4 0 1.400.5 2.100 1.200 2.400-.3-2.600.2-4.900 1.500-6.600",
  flip: "M8 3.500c3.200 0 5.600 2 6.800 4.500-1.200 2.500-3.600 4.500-6.800 4.500S2.400 10.500 1.200 8C2.400 5.500 4.800 3.500 8 3.500m0 1.800a2.700 2.700 0 1 0 0 5.400 2.700 2.700 0 0 0 0-5.400",
  verdict:
    "M8 1.500a6.500 6.500 0 1 1 0 13 6.500 6.500 0 0 1 0-13M4.300 8.300l2.600 2.700 4.900-5.100-1.100-1.100-3.800 4-1.500-1.600z",
};
const MORE =
  "M2.500 6.700a1.300 1.300 0 1 1 0 2.600 1.300 1.300 0 0 1 0-2.600m5.500 0a1.300 1.300 0 1 1 0 2.600 1.300 1.300 0 0 1 0-2.600m5.500 0a1.300 1.300 0 1 1 0 2.600 1.300 1.300 0 0 1 0-2.600";

const select = (label, change, ...options) =>
  element("select", { "aria-label": label, onchange: ({ target }) => change(target.value) }, ...options);
const option = (value, title) => element("option", { value: String(value) }, title);
const button = (label, does, more = {}) =>
  element("button", { type: "button", class: "button small", onclick: does, ...more }, label);

export class CompareBar {
  #told = "";

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
    this.signs.title = "Signed: brighter than grey where the right picture is brighter";
    this.gains = select(
      "How much the difference is brightened",
      (gain) => choose({ gain: Number(gain) }),
      ...GAINS.map((gain) => option(gain, `×${gain}`)),
    );
    this.asks = button("Ask again", ask, { class: "button small asks" });
    const close = button("Done", () => acts.stopComparing(), { class: "button small close" });
    this.metric = element("p", { class: "metric", role: "status", "aria-label": "Verdict" });
    // The mode stands between what is compared, drawn as its icon.
    this.sign = drawn(OUTLINES.swipe);
    this.mode = element("span", { class: "mode" }, this.sign, this.modes);
    const often = element("div", { class: "often" }, this.signs, this.gains, this.asks, this.#edited(acts, models));
    const further = element("div", { class: "further", id: freshId("further") }, often, this.#variants(acts));
    root.append(
      element(
        "div",
        { class: "compare-row" },
        this.left,
        this.mode,
        this.right,
        this.#ways(choose),
        this.#opener(further),
        further,
        close,
      ),
      this.#photo(takePhoto, setPhoto),
      this.metric,
    );
  }

  // The modes once more, side by side where there is room.
  #ways(choose) {
    this.ways = element(
      "div",
      { class: "ways", role: "radiogroup", "aria-label": "Ways to compare" },
      ...Object.entries(MODES).map(([value, title]) =>
        element(
          "button",
          { type: "button", role: "radio", class: "button icon", "data-value": value, "aria-label": title, title },
          drawn(OUTLINES[value]),
        ),
      ),
    );
    this.markWay = watchChoice(this.ways, "button:enabled", ({ dataset }) => choose({ mode: dataset.value }));
    return this.ways;
  }

  // The button of what is not in the row.
  #opener(further) {
    const opener = element(
      "button",
      {
        type: "button",
        class: "button icon more-of-it",
        "aria-label": "More of the comparison",
        "aria-controls": further.id,
        "aria-expanded": "false",
        onclick: () => open(opener.ariaExpanded !== "true"),
      },
      drawn(MORE),
    );
    const open = (is) => opener.setAttribute("aria-expanded", String(is));
    this.root.addEventListener("keydown", (event) => {
      if (event.key !== "Escape" || opener.ariaExpanded !== "true") return;
      event.stopPropagation();
      open(false);
      opener.focus();
    });
    return opener;
  }

  // Which variant is edited, and what B is, where that is at a side.
  #edited(acts, models) {
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
    this.edited = element("div", { class: "of-variants" }, sides, turn);
    return this.edited;
  }

  // What is seldom done with the variants.
  #variants(acts) {
    this.variants = element(
      "div",
      { class: "of-variants seldom" },
      button("Swap A and B", () => acts.swapVariants()),
      button("Discard B", () => acts.discardB(), { title: "Throws variant B away. Done keeps it." }),
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
    this.mode.title = MODES[mode];
    this.sign.firstChild.setAttribute("d", OUTLINES[mode]);
    for (const each of this.modes.options) each.disabled = isPhoto && ASKED.includes(each.value);
    for (const each of this.ways.children) each.disabled = isPhoto && ASKED.includes(each.dataset.value);
    this.markWay(({ dataset }) => dataset.value === mode);
    for (const side of ["left", "right"]) this[side].dataset.shows = names[side];
    this.signs.hidden = mode !== "difference";
    this.signs.value = compare.isSigned ? "signed" : "absolute";
    this.gains.hidden = !["difference", "heat"].includes(mode);
    this.gains.value = String(gainOf(compare));
    this.asks.hidden = !ASKED.includes(mode);
    this.asks.textContent = isAsking ? "Stop" : "Ask again";
    this.edited.hidden = this.variants.hidden = !shows(compare, "b");
    this.root.dataset.further = [
      ...(this.variants.hidden ? [] : ["variants"]),
      ...(this.gains.hidden && this.asks.hidden ? [] : ["tuned"]),
    ].join(" ");
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

  // One line: `text`, and `beside` it what matters less; `facts` are in a tooltip. What is awaited has a `share`, 0 where
  // that is not known yet; a map has a `scale`, as `legend` takes it. `isSpoken`: to those who cannot see it, too.
  tell({ text, beside = "", share = null, scale = null, facts = "", isSpoken = false }) {
    const live = isSpoken ? "polite" : "off"; // figures that follow the samples would never be silent
    if (this.metric.ariaLive !== live) this.metric.ariaLive = live;
    const told = JSON.stringify([text, beside, share, scale, facts]);
    if (told === this.#told) return;
    this.#told = told;
    this.metric.title = [text, beside, facts].filter(Boolean).join(" · ");
    const done = { max: "1", "aria-label": "Compared", ...(share ? { value: String(share) } : {}) };
    this.metric.replaceChildren(
      element("b", {}, text),
      share === null ? "" : element("progress", done),
      element("span", { class: "beside" }, beside && ` · ${beside}`),
      scale ? legend(scale) : "",
    );
  }
}

// {from, to, map}: the words for both ends of a map's colours.
const legend = ({ from, to, map }) =>
  element("span", { class: `scale ${map}` }, from, element("i", { "aria-hidden": "true" }), to);
