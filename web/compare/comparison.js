// Two pictures beside or over each other, and what lies between them: variants of a material, snapshots, final renders,
// a photograph.

import { amount } from "../lib/format-text.js";
import { kindOf } from "../lib/files.js";
import { element } from "../lib/dom.js";
import { Paced } from "../lib/paced.js";
import { equal } from "../lib/patch.js";
import { ASKED, MODES, PHOTO, compared, gainOf, modeOf, placed, sidesOf } from "../document/variants.js";
import { CompareBar } from "./bar.js";
import { sideOf } from "./sides.js";
import { difference } from "./difference.js";
import { Photograph } from "./photograph.js";
import { Question, besideOf, factsOf, flipWords, progressWords, verdictWords } from "./verdict.js";

const DIFFERENCE_MS = 250; // between two of them
const REST_MS = 1000; // an edit that has rested so long is asked about
const SIDES = ["left", "right"];
const BETWEEN = ["difference", "heat"]; // shown by one picture, which is made here
const SPLIT = ["swipe", "verdict"]; // shown as two halves under a bar that moves

const percent = (x) => `${(100 * x).toFixed(2)} %`;

export class Comparison {
  #open = new Map(); // by name: what stands at the sides
  #differences = new Paced(DIFFERENCE_MS, () => this.#compare());
  #photograph = null;
  #wanted = null; // of the page's own stream, while something is compared
  #resting = { subjects: null, timer: 0 }; // what is asked about unless it is edited again

  // `places`: {root, stage, divider, canvas, difference}; `first` the viewport of A; `acts` the editor; `models` are
  // those that B can be turned into; `names(aov, document)` of layers; `headerOfA()` that of A's picture.
  constructor(places, { first, acts, models, names, headerOfA }) {
    Object.assign(this, places, { first, acts });
    this.needs = {
      first,
      acts,
      names,
      headerOfA,
      second: this.canvas,
      photograph: () => this.#photograph,
      painted: () => this.painted(),
      refused: (problem, valid) => this.#takeBack(problem, valid),
      complain: (problem) => acts.complain(problem),
    };
    this.question = new Question({ changed: () => this.#review() });
    this.bar = new CompareBar(this.root, {
      acts,
      models,
      choose: (members) => acts.amend({ compare: { ...this.#compared, ...members } }),
      place: (side, name) => acts.amend(placed(acts.state, side, name)),
      ask: () => (this.question.isAsking ? this.#stop() : this.#ask()),
      takePhoto: (file) => this.#takePhoto(file),
      setPhoto: (stops) => this.#setPhoto(stops),
    });
    this.divider.addEventListener("input", () => this.#split());
    this.#watchDrops();
    // The tools are under it.
    new ResizeObserver(() => {
      document.documentElement.style.setProperty("--bar", `${this.root.offsetHeight}px`);
    }).observe(this.root);
  }

  // {mode, gain, ...}: what is compared and how, or null.
  get #compared() {
    return compared(this.acts.state);
  }

  get #mode() {
    return modeOf(this.#compared);
  }

  // What stands at the left and at the right.
  get #sides() {
    const names = sidesOf(this.#compared);
    return SIDES.map((side) => this.#open.get(names[side]));
  }

  get isOn() {
    return this.#wanted !== null;
  }

  // Where both stand beside each other, each has half the width, and as much less height: all of the view stays.
  fit(box) {
    const width = box.width / 2 - 1;
    const isBeside = this.#compared !== null && this.#mode === "beside";
    return isBeside ? { width, height: (width * box.height) / box.width } : box;
  }

  // `wanted` of the page's own stream, as Stream.show takes it, or null: nothing is compared.
  show(wanted, paused) {
    if (wanted && !this.isOn) this.bar.choices.refresh();
    this.#wanted = wanted;
    const isOn = wanted !== null;
    this.root.hidden = !isOn;
    if (isOn) this.stage.dataset.compare = this.#mode;
    else delete this.stage.dataset.compare;
    this.#arrange(isOn ? sidesOf(this.#compared) : {});
    this.divider.hidden = !isOn || !SPLIT.includes(this.#mode);
    this.difference.hidden = !isOn || ![...BETWEEN, ...ASKED].includes(this.#mode);
    if (!isOn) {
      this.stage.classList.remove("awaiting");
      return this.question.forget();
    }
    this.#split();
    for (const side of this.#open.values()) side.show(wanted, paused);
    this.#consult();
    this.#review();
    this.painted();
  }

  // Opens what is to stand at the sides, closes the rest, and puts the canvases where they belong.
  #arrange(names) {
    const wanted = Object.values(names);
    for (const [name, side] of this.#open)
      if (!wanted.includes(name)) {
        this.#open.delete(name);
        side.close();
        if (side.canvas.classList.contains("half")) side.canvas.remove();
      }
    for (const name of wanted)
      if (!this.#open.has(name)) {
        const side = sideOf(name, this.needs);
        this.#open.set(name, side);
        if (!side.canvas.isConnected) this.difference.before(side.canvas);
        this.#empty(); // of what lay between others
      }
    this.canvas.hidden = !wanted.includes("b");
    for (const canvas of [this.first.canvas, this.canvas]) canvas.dataset.half = "none";
    for (const side of SIDES) if (names[side]) this.#open.get(names[side]).canvas.dataset.half = side;
    if (!wanted.length) for (const canvas of [this.first.canvas, this.canvas]) delete canvas.dataset.half;
  }

  #empty() {
    this.difference.width = this.difference.height = 1;
  }

  // What the server did not take of B goes back to what it has.
  #takeBack(problem, valid) {
    const { compare } = this.acts.state;
    this.acts.complain(problem);
    const document = valid?.scene.materials[compare?.material];
    if (document) this.acts.amend({ compare: { ...compare, document } });
  }

  #split() {
    this.stage.style.setProperty("--split", `${100 * this.divider.valueAsNumber}%`);
    const left = this.#open.get(sidesOf(this.#compared).left).names.short;
    this.divider.setAttribute("aria-valuetext", `${Math.round(100 * this.divider.valueAsNumber)} % ${left}`);
  }

  // --- the photograph ---

  async #takePhoto(file) {
    try {
      const photograph = await Photograph.from(file);
      this.#photograph?.close();
      this.#photograph = photograph;
      this.acts.forgive();
      this.acts.amend(this.#open.has(PHOTO) ? {} : placed(this.acts.state, "right", PHOTO));
    } catch (problem) {
      this.acts.complain(problem);
    }
  }

  #setPhoto(stops) {
    this.#photograph.stops = { ...stops };
    this.#open.get(PHOTO).show(this.#wanted);
    this.#review();
    this.painted();
  }

  // An image that falls onto the bar, or onto the picture where a photograph stands there, is one.
  #watchDrops() {
    for (const place of [this.root, this.stage.parentElement])
      place.addEventListener("drop", (event) => {
        const [file] = event.dataTransfer.files;
        if (!this.isOn || !file || kindOf(file) !== "image" || event.defaultPrevented) return;
        if (place !== this.root && !this.#open.has(PHOTO)) return;
        event.preventDefault(); // the page sees it too, and only puts its own hint away
        this.#takePhoto(file);
      });
  }

  // --- what the server says ---

  get #subjects() {
    return this.#sides.map(({ subject }) => subject);
  }

  // What is to be compared there: where one is a render, at its size.
  get #size() {
    const { width, height } = this.#sides.find(({ size }) => size)?.size ?? this.#wanted.settings;
    return { width, height };
  }

  // Asks when this is chosen, and again when an edit rests. An edit ends what was asked before it.
  #consult() {
    const names = sidesOf(this.#compared);
    if (!ASKED.includes(this.#mode)) return this.question.forget();
    if (!this.question.isAbout(this.#mode, names)) {
      this.question.forget();
      this.#empty();
      if (this.#sides.every(({ header, subject }) => header && subject)) this.#ask();
    } else if (this.question.isOutdated(this.#subjects)) {
      this.question.stop();
      this.#askSoon(this.#subjects);
    }
  }

  #askSoon(subjects) {
    if (equal(subjects, this.#resting.subjects)) return;
    clearTimeout(this.#resting.timer);
    const timer = setTimeout(() => {
      this.#resting.subjects = null;
      const isWanted = this.isOn && ASKED.includes(this.#mode) && this.question.isOutdated(this.#subjects);
      if (isWanted && this.#sides.every(({ header, subject }) => header && subject)) this.#ask();
    }, REST_MS);
    this.#resting = { subjects, timer };
  }

  #ask() {
    this.#empty();
    this.question.ask(this.#mode, this.#subjects, sidesOf(this.#compared), this.#size);
  }

  #stop() {
    this.question.stop();
    this.#review();
  }

  // Says how things stand, and draws what was answered.
  #review() {
    if (!this.isOn) return;
    this.#label();
    const { question } = this;
    const isOutdated = question.isOutdated(this.#subjects);
    this.bar.show(this.#compared, { photograph: this.#photograph, isAsking: question.isAsking });
    if (!ASKED.includes(this.#mode)) return;
    if (!question.answer || isOutdated) this.#empty();
    else this.#draw(question.answer);
    this.bar.tell({ ...this.#words(), isSpoken: question.progress === null });
  }

  #words() {
    const { answer, problem, progress, isAsking } = this.question;
    const isFlip = this.#mode === "flip";
    const awaited = this.#awaited();
    if (awaited) return { text: awaited };
    if (isAsking) {
      const beside = progress ? progressWords(progress, progress.seconds) : "";
      return { text: "Comparing…", beside, share: progress ? progress.samples / progress.max_samples : 0 };
    }
    if (this.question.isOutdated(this.#subjects)) return { text: "Changed: it is compared again in a moment" };
    if (problem) return { text: problem };
    if (!answer) return { text: "Stopped" };
    const { verdict, place } = answer;
    const certainty = verdict.different ? { from: "almost certain", to: "certain", map: "of-p" } : null;
    const scale = isFlip ? { from: "not seen", to: "plainly seen", map: "of-flip" } : certainty;
    return {
      text: isFlip ? flipWords(verdict) : verdictWords(verdict, place),
      beside: isFlip ? "" : besideOf(verdict),
      scale,
      facts: factsOf(verdict),
    };
  }

  // As high as the frame, as the pictures under it are; the map of FLIP is a picture of its own.
  #draw({ image }) {
    const frame = this.#mode === "flip" ? image : this.first.canvas;
    const shape = { width: (image.height * frame.width) / frame.height, height: image.height };
    Object.assign(this.difference, { width: Math.round(shape.width), height: shape.height });
    this.difference.getContext("2d").putImageData(image, (this.difference.width - image.width) / 2, 0);
  }

  // --- what is seen ---

  // "B is waiting for its first frame", or null.
  #awaited() {
    const missing = this.#sides.find(({ header }) => !header);
    return missing ? `${missing.names.long[0]} is ${missing.awaited}` : null;
  }

  // Of each half "A · Principled · 16 samples", of a difference what of what.
  #label() {
    const put = (side, words, samples) => {
      const [number, unit] = samples ? amount(samples, "sample").split(" ") : [];
      const parts = [...words, number].filter(Boolean).join(" · ");
      const label = this.stage.querySelector(`.variant.${side === "left" ? "a" : "b"}`);
      label.dataset.shows = sidesOf(this.#compared)[side];
      label.replaceChildren(parts, element("span", { class: "unit" }, unit ? ` ${unit}` : ""));
    };
    const sides = this.#sides;
    const missing = sides.find(({ header }) => !header);
    this.stage.classList.toggle("awaiting", Boolean(missing));
    for (const { canvas, header } of sides) canvas.toggleAttribute("data-awaited", !header);
    const isBetween = BETWEEN.includes(this.#mode);
    if (isBetween || this.#mode === "flip") {
      put("left", [isBetween ? `${MODES[this.#mode]} ×${gainOf(this.#compared)}` : MODES.flip]);
      const [left, right] = sides.map(({ names }) => names.short);
      put("right", missing ? [...missing.names.long, missing.awaited] : [`${left} against ${right}`]);
    } else
      sides.forEach(({ names, header, awaited }, i) =>
        put(SIDES[i], [...names.long, !header && awaited], header?.samples),
      );
  }

  // After a frame of either: the difference and its measure follow at their own pace.
  painted() {
    if (this.isOn) this.#differences.ask();
  }

  #compare() {
    if (!this.isOn || !this.#compared) return;
    for (const side of this.#open.values()) side.settle();
    if (ASKED.includes(this.#mode)) {
      this.#consult();
      return this.#review();
    }
    this.#label();
    const sides = this.#sides;
    const headers = sides.map(({ header }) => header);
    if (!headers.every(Boolean)) return this.bar.tell({ text: this.#awaited() });
    const [a, b] = sides.map(({ canvas }) => canvas);
    const isSame = a.width === b.width && a.height === b.height;
    // A preview is not the picture: what is measured on it says nothing. Its difference is shown all the same.
    const isMeasured = isSame && headers.every(({ scale }) => scale >= 1);
    if (!isMeasured) this.bar.tell({ text: "RMSE …" });
    const isShown = BETWEEN.includes(this.#mode);
    if (!isSame || !(isMeasured || isShown)) return;
    const out = isShown ? new ImageData(a.width, a.height) : null;
    const measured = this.#difference(sides, out);
    if (out) {
      Object.assign(this.difference, { width: a.width, height: a.height });
      this.difference.getContext("2d").putImageData(out, 0, 0);
    }
    if (isMeasured) this.#measured(measured, headers);
  }

  #difference(sides, out) {
    const { isSigned } = this.#compared;
    const spans = sides.map(({ span }) => span).filter(Boolean);
    const span = spans.length
      ? [Math.max(...spans.map(([from]) => from)), Math.min(...spans.map(([, to]) => to))]
      : null;
    const drawn = this.#mode === "heat" ? "heat" : isSigned ? "signed" : "absolute";
    const [first, second] = sides.map((side) => side.pixels());
    return difference(first, second, out, { gain: gainOf(this.#compared), drawn, span });
  }

  #measured({ rmse, psnr, most }, headers) {
    const samples = headers.map((header) => header.samples);
    const isUneven = samples.every(Boolean) && samples[0] !== samples[1];
    const beside = [
      ...(Number.isFinite(psnr) ? [`PSNR ${psnr.toFixed(1)} dB`] : []),
      `largest ${percent(most)}`,
      ...(isUneven ? [`at ${samples[0]} and ${samples[1]} samples`] : []),
    ].join(" · ");
    this.bar.tell({ text: `RMSE ${percent(rmse)}`, beside });
  }
}
