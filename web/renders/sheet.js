// What is to be rendered: the size, which need not be the window's, and the quality; and the button that starts it.

import { element, freshId } from "../lib/dom.js";
import { duration, percent, sentence } from "../lib/format-text.js";
import { schemaForm } from "../forms/schema-form.js";
import { priceOf, qualityWords, wordOf } from "../forms/quality.js";
import { detailWords } from "../server/problem-text.js";
import { fields } from "../server/schema.js";
import { CUSTOM, SHAPES, SIZES, STANDARD, WINDOW, choiceOf, sizeOf, times, withSide } from "./sizes.js";

const SIDES = ["width", "height"];

export class RenderSheet {
  #choice = STANDARD;
  #settings = {};
  #screen = { width: 1, height: 1 };

  // `acts` is the editor; `head` the button in the header that renders from anywhere, `headSize` where it says the
  // size; `start(size)` starts a render, `complain(problem)`.
  constructor(root, { schema, acts, head, headSize, start, complain }) {
    Object.assign(this, { schema, acts, head, headSize, start, complain });
    const id = freshId("size");
    const option = (value, title) => element("option", { value }, title);
    this.picker = element(
      "select",
      { id, onchange: () => this.#choose(this.picker.value) },
      ...Object.entries(SIZES).map(([name, { title, width, height }]) =>
        option(name, `${title}, ${times(width, height)}`),
      ),
      ...SHAPES.map((shape) => option(shape, `Shape ${shape.replace(":", " : ")}`)),
      option(WINDOW, "As the window"),
      option(CUSTOM, "Custom"),
    );
    this.form = schemaForm(
      SIDES.map((name) => fields(schema.settings, schema.settings).find((field) => field.name === name)),
      {
        change: (name, value) => this.#write(name, value),
        commit: () => acts.endGesture(),
        forgive: () => acts.forgive(),
      },
    );
    this.qualities = element("div", { class: "qualities", role: "radiogroup", "aria-label": "Quality" });
    this.markQuality = qualityWords(this.qualities, (name) => this.#pick(name));
    this.note = element("p", { class: "note", id: freshId("cost") });
    this.button = element(
      "button",
      { type: "button", class: "button primary", "aria-describedby": this.note.id, onclick: () => this.render() },
      "Render picture",
    );
    root.append(
      element("div", { class: "field whole" }, element("label", { for: id }, "Size"), this.picker),
      this.form.element,
      this.qualities,
      element("div", { class: "row" }, this.button),
      this.note,
    );
  }

  // Null is the standard size, which leaves the picture on screen as wide as its window.
  #put(size) {
    const { width: _, height: __, ...settings } = this.#settings;
    this.acts.change({ settings: size ? { ...settings, ...size } : settings }, "size");
  }

  #choose(choice) {
    this.acts.forgive();
    this.#choice = choice;
    this.#put(sizeOf(choice, this.size, this.#screen));
    this.acts.endGesture();
  }

  #write(name, value) {
    this.acts.forgive();
    if (value === undefined) return this.#put(null);
    return this.#put(withSide(this.#choice, this.size, name, value));
  }

  // A quality brings its samples: what was set by hand in their place goes.
  #pick(quality) {
    const { max_samples: _, target_noise: __, time_limit: ___, ...settings } = this.#settings;
    this.acts.change({ settings: { ...settings, quality } });
    this.acts.endGesture();
  }

  // `screen`: the size of the picture on screen; `presets` with what they cost; `live`: the header of its newest frame.
  show(settings, { screen, presets, live, limits }) {
    [this.#settings, this.#screen] = [settings, { width: screen.width, height: screen.height }];
    const standard = SIZES[STANDARD];
    const fallback = standard.width * standard.height > limits.max_pixels ? this.#screen : standard;
    const { width = fallback.width, height = fallback.height } = settings;
    this.size = { width, height };
    this.#choice = choiceOf(this.size, this.#choice, this.#screen);
    this.picker.value = this.#choice;
    for (const option of this.picker.options) {
      const named = SIZES[option.value];
      option.disabled = Boolean(named) && named.width * named.height > limits.max_pixels;
    }
    this.form.show(settings, this.size);
    const known = this.schema.settings.properties.quality.default;
    const { quality = known, max_samples, target_noise, time_limit } = settings;
    const isOwn = Boolean(max_samples || target_noise || time_limit);
    this.markQuality(presets, { standard: known, chosen: isOwn ? null : quality, live, size: this.size });
    const what = [times(this.size.width, this.size.height), ...(isOwn ? [] : [wordOf(quality, presets, known)])];
    const text = `Renders ${what.join(", ")}${this.#cost(isOwn ? settings : presets[quality], live)}.`;
    if (this.note.textContent !== text) this.note.textContent = text;
    this.headSize.textContent = `${this.size.width}×${this.size.height}`;
    this.head.title = text;
  }

  // " in about 4 min, as measured on this scene", or what else ends it.
  #cost({ time_limit, target_noise, ...limit }, live) {
    if (time_limit) return ` in at most ${duration(time_limit)}`;
    if (target_noise) return `, down to ${percent(target_noise)} noise`;
    const price = priceOf(limit, { live, size: this.size });
    if (!price) return "";
    return ` in about ${duration(price.seconds)}, ${price.isListed ? "estimated" : "as measured on this scene"}`;
  }

  // Starts the render that the buttons promise.
  async render() {
    this.form.forgive();
    this.button.disabled = this.head.disabled = true;
    try {
      await this.start(this.size);
    } catch (problem) {
      const isSaid = (problem.errors ?? []).map(({ pointer, detail }) =>
        this.form.mark(pointer.split("/")[2], sentence(detailWords(detail))),
      );
      if (!isSaid.length || isSaid.includes(false)) this.complain(problem);
    }
    this.button.disabled = this.head.disabled = false;
  }
}
