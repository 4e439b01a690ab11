// Two variants of one material: a second stream beside the first, and what lies between their pictures.

import { element } from "../lib/dom.js";
import { Stream } from "../server/stream.js";
import { watchChoice } from "../lib/tabs.js";
import { Viewport } from "./viewport.js";
import { inWords } from "../lib/format-text.js";

const MODES = { swipe: "Swipe", beside: "Side by side", difference: "Difference" };
const DIFFERENCE_MS = 250; // between two of them
const GAINS = [1, 2, 4, 8, 16, 64];
const USUAL = 4; // an eighth of the range is seen as half of it

// {rmse, psnr, most} of two pictures of one size, in displayed values of 0..1; paints |a - b| * gain.
export function difference(a, b, out = null, gain = 1) {
  let sum = 0;
  let most = 0;
  for (let i = 0; i < a.data.length; i += 4) {
    for (let k = 0; k < 3; k += 1) {
      const d = Math.abs(a.data[i + k] - b.data[i + k]);
      sum += d * d;
      most = Math.max(most, d);
      if (out) out.data[i + k] = d * gain;
    }
    if (out) out.data[i + 3] = 255;
  }
  const rmse = Math.sqrt(sum / (0.75 * a.data.length)) / 255;
  return { rmse, psnr: rmse > 0 ? -20 * Math.log10(rmse) : Infinity, most: most / 255 };
}

export class Comparison {
  mode = "swipe";
  gain = USUAL;
  #stream = null;
  #viewport = null;
  #header = null;
  #differed = 0;
  #paused = false;

  // `places`: {root, stage, divider, canvas, difference}; `first` the viewport of A; `acts` the editor;
  // `changed()` when the picture's size may be another one; `models` those that B can be turned into;
  // `beside()` the session of A, `headerOfA()` that of its picture.
  constructor(places, { first, acts, models, changed, names, lost, beside, headerOfA }) {
    Object.assign(this, places, { first, acts, changed, names, lost, beside, headerOfA });
    this.#build(models);
    this.divider.addEventListener("input", () => this.#split());
  }

  #build(models) {
    const radio = (name, title) =>
      element("button", { type: "button", role: "radio", class: "button small", "data-value": name }, title);
    const modes = element(
      "div",
      { class: "cluster", role: "radiogroup", "aria-label": "How the variants are shown" },
      ...Object.entries(MODES).map((each) => radio(...each)),
    );
    const sides = element(
      "div",
      { class: "cluster", role: "radiogroup", "aria-label": "Which variant is edited" },
      element("span", { class: "note" }, "Edit"),
      radio("a", "A"),
      radio("b", "B"),
    );
    const turn = element(
      "select",
      {
        "aria-label": "Turn variant B into another model",
        onchange: () => {
          if (turn.value) this.acts.pickVariant(turn.value);
          turn.value = "";
        },
      },
      element("option", { value: "" }, "B as…"),
      ...models.map((name) => element("option", { value: name }, inWords(name))),
    );
    const swap = element(
      "button",
      { type: "button", class: "button small", onclick: () => this.acts.swapVariants() },
      "Swap",
    );
    const close = element(
      "button",
      { type: "button", class: "button small close", onclick: () => this.acts.stopComparing() },
      "Done",
    );
    this.gains = element(
      "select",
      {
        "aria-label": "How much the difference is brightened",
        onchange: () => {
          this.gain = Number(this.gains.value);
          this.painted();
        },
      },
      ...GAINS.map((gain) => element("option", { value: String(gain), selected: gain === USUAL }, `×${gain}`)),
    );
    this.metric = element("span", { class: "metric" });
    this.root.append(modes, this.gains, sides, turn, swap, close, this.metric);
    this.markMode = watchChoice(modes, "button", ({ dataset }) => this.pick(dataset.value));
    this.markSide = watchChoice(sides, "button", ({ dataset }) => this.acts.editSide(dataset.value));
  }

  pick(mode) {
    this.mode = mode;
    this.changed();
  }

  get isOn() {
    return this.#stream !== null;
  }

  // Where both stand beside each other, each has half the width, and as much less height: all of the view stays.
  fit(box) {
    const width = box.width / 2 - 1;
    return this.mode === "beside" ? { width, height: (width * box.height) / box.width } : box;
  }

  // `wanted` for variant B as Stream.show takes it, or null: no comparison.
  show(wanted, paused) {
    if (wanted && !this.#stream) this.#open();
    if (!wanted && this.#stream) this.#close();
    const on = wanted !== null;
    this.root.hidden = !on;
    if (on) this.stage.dataset.compare = this.mode;
    else delete this.stage.dataset.compare;
    this.canvas.hidden = !on;
    this.divider.hidden = !on || this.mode !== "swipe";
    this.difference.hidden = this.gains.hidden = !on || this.mode !== "difference";
    if (!on) return;
    this.markMode(({ dataset }) => dataset.value === this.mode);
    this.markSide(({ dataset }) => dataset.value === this.acts.state.compare.side);
    if (paused !== this.#paused) {
      this.#paused = paused;
      if (paused) this.#stream.pause();
      else this.#stream.resume();
    }
    this.#split();
    this.#stream.show(wanted);
    this.painted();
  }

  #open() {
    this.#viewport = new Viewport(this.canvas, {
      names: (aov) => this.names(aov, this.#stream.document),
      painted: ({ header }) => {
        this.#header = header;
        this.painted();
      },
    });
    this.#stream = new Stream(
      {
        hello: () => this.#viewport?.restart(),
        frame: (header, bytes, view, acknowledge) => this.#viewport?.show(header, bytes, view, acknowledge),
        done: () => this.painted(),
        waiting() {},
        refused: (problem, valid) => this.#takeBack(problem, valid),
        lost: (reason) => this.lost(reason),
      },
      this.beside,
    );
    this.#stream.connect();
  }

  // What the server did not take of B goes back to what it has.
  #takeBack(problem, valid) {
    const { compare } = this.acts.state;
    this.acts.complain(problem);
    const document = valid?.scene.materials[compare?.material];
    if (document) this.acts.amend({ compare: { ...compare, document } });
  }

  #close() {
    this.#stream.close();
    this.#viewport.close();
    this.#stream = this.#viewport = this.#header = null;
    this.#paused = false;
  }

  #split() {
    this.canvas.style.setProperty("--split", `${100 * this.divider.valueAsNumber}%`);
    this.divider.setAttribute("aria-valuetext", `${Math.round(100 * this.divider.valueAsNumber)} % A`);
  }

  // After a frame of either: the difference and its measure follow at their own pace.
  painted() {
    if (!this.isOn || !this.#header || this.timer) return;
    this.timer = setTimeout(
      () => {
        this.timer = null;
        this.#compare();
      },
      Math.max(0, this.#differed + DIFFERENCE_MS - performance.now()),
    );
  }

  // What the halves are: "A · Principled · 16 samples".
  #label(headers) {
    const { compare, scene } = this.acts.state;
    const types = [scene.materials[compare.material]?.type, compare.document.type];
    ["a", "b"].forEach((side, i) => {
      const words = [side.toUpperCase(), types[i] && inWords(types[i]), headers[i] && String(headers[i].samples)];
      const unit = element(
        "span",
        { class: "unit" },
        headers[i] ? ` sample${headers[i].samples === 1 ? "" : "s"}` : "",
      );
      this.stage.querySelector(`.variant.${side}`).replaceChildren(words.filter(Boolean).join(" · "), unit);
    });
  }

  #compare() {
    this.#differed = performance.now();
    if (!this.isOn) return;
    const headers = [this.headerOfA(), this.#header];
    this.#label(headers);
    // A preview is not the picture: what is measured on it says nothing.
    if (headers.some((header) => !(header?.scale >= 1))) {
      this.metric.replaceChildren("RMSE …");
      return;
    }
    const [a, b] = [this.first.canvas, this.canvas];
    if (a.width !== b.width || a.height !== b.height) return;
    const isShown = this.mode === "difference";
    const out = isShown ? new ImageData(a.width, a.height) : null;
    const { rmse, psnr, most } = difference(this.first.pixels(), this.#viewport.pixels(), out, this.gain);
    if (out) {
      Object.assign(this.difference, { width: a.width, height: a.height });
      this.difference.getContext("2d").putImageData(out, 0, 0);
    }
    const percent = (x) => `${(100 * x).toFixed(2)} %`;
    const [ofA, ofB] = headers.map(({ samples }) => samples);
    this.metric.replaceChildren(
      "RMSE ",
      element("b", {}, percent(rmse)),
      element(
        "span",
        { class: "beside" },
        [
          "",
          ...(Number.isFinite(psnr) ? [`PSNR ${psnr.toFixed(1)} dB`] : []),
          `largest ${percent(most)}`,
          ...(ofA === ofB ? [] : [`at ${ofA} and ${ofB} samples`]),
        ].join(" · "),
      ),
    );
    this.metric.title = "Of the displayed colours, white being 100 %; noise counts until both are done";
  }
}
