// The picture that is taken along: its size, which need not be the window's, and its render, a job on the server that
// goes on when this page is closed. What is on screen takes the same shape, so that it shows what will be rendered.

import * as api from "../server/api.js";
import { element, freshId } from "../lib/dom.js";
import { saveAs } from "../lib/files.js";
import { detailWords } from "../server/problem-text.js";
import { fields } from "../server/schema.js";
import { schemaForm } from "../forms/schema-form.js";
import { amount, duration, sentence } from "../lib/format-text.js";

const WINDOW = "window";
const FREE = "free";
const SHAPES = ["16:9", "3:2", "4:3", "5:4", "1:1", "4:5", "2:3", "9:16"];
const SIDES = ["width", "height"];
const PLACE = "sunbox.render"; // in sessionStorage: the job that this tab began
const WAIT_S = 2; // the server answers sooner when the job ends

const ratioOf = (shape) => shape.split(":").reduce((a, b) => Number(a) / Number(b));
const times = (width, height) => `${width}\u202f×\u202f${height}`;

// Seconds that a picture of some size takes, from the header of one that is being rendered.
export function forecastSize({ width, height }, samples, live) {
  if (!(live?.samples >= 4 && live.scale === 1) || !samples) return null;
  return ((live.elapsed_s / live.samples) * samples * width * height) / (live.width * live.height);
}

export class Output {
  #shape = WINDOW;
  #settings = {};
  #screen = { width: 1, height: 1 };
  #job = null; // {id, width, height, samples}
  #turn = 0; // rises with each job: answers for an older one are dropped

  // `acts` is the editor; `order()` gives {scene, settings} to render, `view()` how it is displayed; `head` is
  // where the button that leads here says the size; `complain`, `say`.
  constructor(root, { schema, acts, order, view, head, complain, say }) {
    Object.assign(this, { acts, order, view, head, complain, say });
    const id = freshId("shape");
    this.shape = element(
      "select",
      { id, onchange: () => this.#reshape(this.shape.value) },
      element("option", { value: WINDOW }, "As the window"),
      ...SHAPES.map((shape) => element("option", { value: shape }, shape.replace(":", " : "))),
      element("option", { value: FREE }, "Free"),
    );
    this.form = schemaForm(
      SIDES.map((name) => fields(schema.settings, schema.settings).find((field) => field.name === name)),
      {
        change: (name, value) => this.#resize(name, value),
        commit: () => acts.rest(),
        forgive: () => acts.forgive(),
      },
    );
    this.note = element("p", { class: "note" });
    this.button = element(
      "button",
      { type: "button", class: "button primary", onclick: () => this.render() },
      "Render picture",
    );
    this.cancel = element(
      "button",
      { type: "button", class: "button", hidden: true, onclick: () => this.#stop() },
      "Cancel",
    );
    this.bar = element("progress", { max: "1", value: "0", "aria-label": "Rendered of the job", hidden: true });
    this.told = element("p", { class: "note", role: "status" });
    this.result = element("div", { class: "result", hidden: true });
    root.append(
      element("div", { class: "field whole" }, element("label", { for: id }, "Shape"), this.shape),
      this.form.element,
      this.note,
      element("div", { class: "row" }, this.button, this.cancel),
      this.bar,
      this.told,
      this.result,
    );
    this.#resume();
  }

  // Undefined sides are the window's.
  #put({ width, height }) {
    const { width: _, height: __, ...settings } = this.#settings;
    this.acts.change({ settings: width === undefined ? settings : { ...settings, width, height } }, "size");
  }

  #reshape(shape) {
    this.#shape = shape;
    if (shape === FREE) return undefined;
    if (shape === WINDOW) this.#put({});
    else {
      const width = this.#settings.width ?? 2 * this.#screen.width;
      this.#put({ width, height: Math.max(1, Math.round(width / ratioOf(shape))) });
    }
    return this.acts.rest();
  }

  // One side was written: the other one follows, unless the shape is free.
  #resize(name, value) {
    this.acts.forgive();
    if (value === undefined) return this.#put({});
    const [width, height] = SIDES.map((side) => this.#settings[side] ?? this.#screen[side]);
    const ratio = SHAPES.includes(this.#shape) ? ratioOf(this.#shape) : width / height;
    const other = Math.max(1, Math.round(name === "width" ? value / ratio : value * ratio));
    if (this.#shape === FREE) return this.#put({ width, height, [name]: value });
    return this.#put(name === "width" ? { width: value, height: other } : { width: other, height: value });
  }

  // `screen`: the size of the picture on screen; `forecast(size)`: the seconds that a size will take, or null.
  show(settings, screen, forecast) {
    [this.#settings, this.#screen] = [settings, screen];
    const { width, height } = settings;
    if (!width || !height) {
      if (this.#shape !== FREE) this.#shape = WINDOW;
    } else if (SHAPES.includes(this.#shape) && Math.abs(height - width / ratioOf(this.#shape)) > 1)
      this.#shape = FREE;
    this.shape.value = this.#shape;
    this.form.show(settings, screen);
    const size = { ...screen, ...(width && height ? { width, height } : {}) };
    const seconds = forecast(size);
    const words = [
      `On screen it has ${times(screen.width, screen.height)} pixels.`,
      seconds && `This size takes about ${duration(seconds)}.`,
    ];
    const text = words.filter(Boolean).join(" ");
    if (this.note.textContent !== text) this.note.textContent = text;
    this.head.textContent = `${size.width}×${size.height}`;
    this.size = size;
  }

  // --- the job ---

  async render() {
    this.form.forgive();
    const { scene, settings } = this.order();
    this.button.disabled = true;
    try {
      const { id } = await api.submitRender(scene, { ...settings, ...this.size });
      this.#watch({ id, ...this.size });
    } catch (problem) {
      this.button.disabled = false;
      const isSaid = (problem.errors ?? []).map(({ pointer, detail }) =>
        this.form.mark(pointer.split("/")[2], sentence(detailWords(detail))),
      );
      if (!isSaid.length || isSaid.includes(false)) this.complain(problem);
    }
  }

  // The job of this tab before it was reloaded.
  #resume() {
    try {
      const job = JSON.parse(sessionStorage.getItem(PLACE));
      if (job?.id) this.#watch(job);
    } catch {
      // No storage: nothing to go on with.
    }
  }

  async #watch(job) {
    const turn = ++this.#turn;
    this.#job = job;
    sessionStorage.setItem(PLACE, JSON.stringify(job));
    this.button.disabled = true;
    this.cancel.hidden = this.bar.hidden = false;
    this.#clear();
    this.told.textContent = "Waiting for its turn";
    for (let wait = 0; ; wait = WAIT_S) {
      try {
        const status = await api.renderStatus(job.id, wait);
        if (turn !== this.#turn) return;
        this.#tell(status);
        if (status.state !== "queued" && status.state !== "running") return void (await this.#end(status));
      } catch (problem) {
        if (turn !== this.#turn) return;
        if (problem.status === 404 || problem.status === 410) return this.#rest(""); // it was kept long enough
        // The server is away, or this page is: the job goes on, or comes back with the server.
        this.told.textContent = problem.message;
        await new Promise((wake) => {
          setTimeout(wake, 1000 * WAIT_S);
        });
      }
    }
  }

  #tell({ state, samples, elapsed_s, eta_s }) {
    this.bar.value = eta_s === null ? 0 : elapsed_s / (elapsed_s + eta_s || 1);
    const left = eta_s === null ? "" : `, ${duration(eta_s)} left`;
    if (state === "running")
      this.told.textContent = `${Math.round(100 * this.bar.value)} %, ${amount(samples, "sample")}${left}`;
  }

  #rest(text) {
    this.#job = null;
    this.button.disabled = false;
    this.cancel.hidden = this.bar.hidden = true;
    this.told.textContent = text;
    sessionStorage.removeItem(PLACE);
  }

  async #stop() {
    const { id } = this.#job ?? {};
    try {
      if (id) await api.cancelRender(id);
    } catch (problem) {
      this.complain(problem);
    }
  }

  async #end({ state, samples, reason, warnings }) {
    const { id, width, height } = this.#job;
    if (state === "failed") return this.#rest(`The render failed. ${sentence(reason ?? "")}`.trim());
    if (!samples) return this.#rest("Cancelled before the first sample");
    const done = `${times(width, height)}, ${amount(samples, "sample")}`;
    this.#rest(state === "done" ? `Done: ${done}` : `Cancelled: ${done} so far`);
    if (warnings?.length) this.told.title = warnings.map((each) => each.detail ?? each).join("\n");
    const file = (label, query, ending) =>
      element(
        "button",
        {
          type: "button",
          class: "button small",
          onclick: () => this.#save(id, query, `sunbox-${width}x${height}-${samples}.${ending}`),
        },
        label,
      );
    const preview = element("img", { alt: "The rendered picture" });
    this.result.replaceChildren(
      preview,
      element(
        "div",
        { class: "row" },
        file("Save as PNG", { format: "png" }, "png"),
        file("PNG, 16 bit", { format: "png", bits: "16" }, "png"),
        file("EXR, all layers", { format: "exr", aov: "all" }, "exr"),
      ),
    );
    this.result.hidden = false;
    this.say("The render is done");
    preview.src = URL.createObjectURL(await api.renderImage(id, { format: "webp", ...this.view() }));
    return preview
      .decode()
      .catch(() => {})
      .finally(() => URL.revokeObjectURL(preview.src));
  }

  #clear() {
    this.result.hidden = true;
    this.result.replaceChildren();
  }

  async #save(id, query, name) {
    try {
      saveAs(await api.renderImage(id, { ...query, ...this.view() }), name);
    } catch (problem) {
      this.complain(problem);
    }
  }
}
