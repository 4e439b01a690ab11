// Two variants of one material: a second stream beside the first, and what lies between their pictures.

import { element } from "../lib/dom.js";
import { Stream } from "../server/stream.js";
import { watchChoice } from "../lib/tabs.js";
import { Viewport } from "./viewport.js";
import { amount, inWords } from "../lib/format-text.js";
import { GAINS, MODES, compared, gainOf, modeOf } from "../document/variants.js";

const DIFFERENCE_MS = 250; // between two of them
const AWAITED = "waiting for its first frame";

// {rmse, psnr, most} of two pictures of one size, in displayed values of 0..1; paints |a - b| * gain,
// or the largest of its channels from black over red and yellow to white.
export function difference(a, b, out = null, gain = 1, isHeat = false) {
  let sum = 0;
  let most = 0;
  for (let i = 0; i < a.data.length; i += 4) {
    let largest = 0;
    for (let k = 0; k < 3; k += 1) {
      const d = Math.abs(a.data[i + k] - b.data[i + k]);
      sum += d * d;
      largest = Math.max(largest, d);
      if (out) out.data[i + k] = d * gain;
    }
    most = Math.max(most, largest);
    if (!out) continue;
    if (isHeat) for (let k = 0; k < 3; k += 1) out.data[i + k] = 3 * largest * gain - 255 * k;
    out.data[i + 3] = 255;
  }
  const rmse = Math.sqrt(sum / (0.75 * a.data.length)) / 255;
  return { rmse, psnr: rmse > 0 ? -20 * Math.log10(rmse) : Infinity, most: most / 255 };
}

export class Comparison {
  #stream = null;
  #viewport = null;
  #header = null;
  #differed = 0;
  #paused = false;

  // `places`: {root, stage, divider, canvas, difference}; `first` the viewport of A; `acts` the editor;
  // `models` are those that B can be turned into;
  // `beside()` the session of A, `headerOfA()` that of its picture.
  constructor(places, { first, acts, models, names, lost, beside, headerOfA }) {
    Object.assign(this, places, { first, acts, names, lost, beside, headerOfA });
    this.#build(models);
    this.divider.addEventListener("input", () => this.#split());
    // The bar has a strip of its own above the picture.
    new ResizeObserver(() => {
      document.documentElement.style.setProperty("--bar", `${this.root.offsetHeight}px`);
    }).observe(this.root);
  }

  // {mode, gain, ...}: what is compared and how, or null.
  get #compared() {
    return compared(this.acts.state);
  }

  #choose(members) {
    this.acts.amend({ compare: { ...this.#compared, ...members } });
  }

  #build(models) {
    const radio = (name, title) =>
      element("button", { type: "button", role: "radio", class: "button small", "data-value": name }, title);
    this.modes = element(
      "select",
      { "aria-label": "Comparison", onchange: () => this.#choose({ mode: this.modes.value }) },
      ...Object.entries(MODES).map(([value, title]) => element("option", { value }, title)),
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
    const discard = element(
      "button",
      {
        type: "button",
        class: "button small",
        title: "Throws variant B away; Done keeps it",
        onclick: () => this.acts.discardB(),
      },
      "Discard B",
    );
    this.gains = element(
      "select",
      {
        "aria-label": "How much the difference is brightened",
        onchange: () => this.#choose({ gain: Number(this.gains.value) }),
      },
      ...GAINS.map((gain) => element("option", { value: String(gain) }, `×${gain}`)),
    );
    this.metric = element("span", { class: "metric", role: "status", "aria-label": "Verdict", "aria-live": "off" });
    this.root.append(this.modes, this.gains, sides, turn, swap, discard, close, this.metric);
    this.markSide = watchChoice(sides, "button", ({ dataset }) => this.acts.editSide(dataset.value));
  }

  get isOn() {
    return this.#stream !== null;
  }

  // Where both stand beside each other, each has half the width, and as much less height: all of the view stays.
  fit(box) {
    const width = box.width / 2 - 1;
    const isBeside = this.isShown("beside");
    return isBeside ? { width, height: (width * box.height) / box.width } : box;
  }

  // Whether one picture shows what lies between both.
  get isBetween() {
    return this.isShown("difference") || this.isShown("heat");
  }

  isShown(mode) {
    return this.#compared !== null && modeOf(this.#compared) === mode;
  }

  // `wanted` for variant B as Stream.show takes it, or null: no comparison.
  show(wanted, paused) {
    if (wanted && !this.#stream) this.#open();
    if (!wanted && this.#stream) this.#close();
    const on = wanted !== null;
    this.root.hidden = !on;
    if (on) this.stage.dataset.compare = modeOf(this.#compared);
    else delete this.stage.dataset.compare;
    this.canvas.hidden = !on;
    this.divider.hidden = !on || !this.isShown("swipe");
    this.difference.hidden = this.gains.hidden = !on || !this.isBetween;
    if (!on) return;
    this.modes.value = modeOf(this.#compared);
    this.gains.value = String(gainOf(this.#compared));
    this.markSide(({ dataset }) => dataset.value === this.#compared.side);
    if (paused !== this.#paused) {
      this.#paused = paused;
      if (paused) this.#stream.pause();
      else this.#stream.resume();
    }
    this.#split();
    this.#stream.show(wanted);
    this.#label();
    this.painted();
  }

  #open() {
    for (const each of [this.canvas, this.difference]) each.width = each.height = 1; // nothing of an earlier B is left
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
    this.stage.classList.remove("awaiting");
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

  // What is seen: of each half "A · Principled · 16 samples", of a difference what of what.
  #label() {
    const { scene } = this.acts.state;
    const { material, document } = this.#compared;
    const headers = { a: this.headerOfA(), b: this.#header };
    const types = { a: scene.materials[material]?.type, b: document.type };
    const names = { a: inWords(types.a ?? ""), b: inWords(types.b ?? "") };
    const put = (side, words, samples) => {
      const [number, unit] = samples ? amount(samples, "sample").split(" ") : [];
      const parts = [...words, number].filter(Boolean).join(" · ");
      this.stage
        .querySelector(`.variant.${side}`)
        .replaceChildren(parts, element("span", { class: "unit" }, unit ? ` ${unit}` : ""));
    };
    this.stage.classList.toggle("awaiting", !headers.b);
    if (this.isBetween) {
      put("a", [`${MODES[modeOf(this.#compared)]} ×${gainOf(this.#compared)}`]);
      put("b", headers.b ? [`A ${names.a} against B ${names.b}`] : ["B", names.b, AWAITED]);
    } else
      for (const side of ["a", "b"])
        put(side, [side.toUpperCase(), names[side], !headers[side] && AWAITED], headers[side]?.samples);
    if (!headers.b) this.metric.replaceChildren(`B is ${AWAITED}`);
  }

  #compare() {
    this.#differed = performance.now();
    if (!this.isOn || !this.#compared) return;
    this.#label();
    const headers = [this.headerOfA(), this.#header];
    const [a, b] = [this.first.canvas, this.canvas];
    const isSame = headers.every(Boolean) && a.width === b.width && a.height === b.height;
    // A preview is not the picture: what is measured on it says nothing. Its difference is shown all the same.
    const isMeasured = isSame && headers.every(({ scale }) => scale >= 1);
    if (!isMeasured) this.metric.replaceChildren("RMSE …");
    const isShown = this.isBetween;
    if (!isSame || !(isMeasured || isShown)) return;
    const out = isShown ? new ImageData(a.width, a.height) : null;
    const gain = gainOf(this.#compared);
    const { rmse, psnr, most } = difference(
      this.first.pixels(),
      this.#viewport.pixels(),
      out,
      gain,
      this.isShown("heat"),
    );
    if (out) {
      Object.assign(this.difference, { width: a.width, height: a.height });
      this.difference.getContext("2d").putImageData(out, 0, 0);
    }
    if (!isMeasured) return;
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
