// The panel that shows how the selected material scatters light: one view at a time, of variant A and, while variants
// are compared, of B over it. The server's shader functions give all numbers; nothing is evaluated here.

import { albedo } from "./albedo.js";
import { csv, standalone } from "./files.js";
import { watchHand } from "./hand.js";
import { Latest } from "./latest.js";
import { plain, texturesOf } from "./material.js";
import { legend } from "./legend.js";
import { angleAt, isBelow, polar, readingAt } from "./polar.js";
import { slice } from "./slice.js";
import { solid } from "./solid.js";
import { Table } from "./table.js";
import { terms } from "./terms.js";
import { isGrey } from "./values.js";
import { askBsdf } from "../server/api.js";
import { element, freshId } from "../lib/dom.js";
import { saveAs } from "../lib/files.js";
import { inWords } from "../lib/format-text.js";
import { problemText } from "../server/problem-text.js";
import { fields, materialModels } from "../server/schema.js";
import { slideByTouch } from "../lib/sliding.js";
import { watchChoice } from "../lib/tabs.js";

const VIEWS = { polar, solid, terms, albedo, slice };
const TURN = Math.PI / 200; // of the solid view, for a CSS pixel
const KEY_TURN = Math.PI / 24;
const LOWEST = -1.5; // radians of the solid view's camera
const ROOMY = 640; // CSS pixels of height that have room for the table, too
const STALE_MS = 400; // without an answer, after which the old plot is dimmed
const REFINE_REST_MS = 150; // without a change, before more is asked of the server

export class LobePanel {
  #options = {
    view: "polar",
    incidence: 45,
    isLog: true,
    channels: "luminance",
    byLobe: false,
    turn: -0.6,
    height: 0.42,
  };
  #data = null; // of the last answer, by variant: {a, b?}
  #shown = null; // {view, data} that the plot shows
  #wanted = null; // the key of what was asked for last
  #latest = new Latest();
  #waiting = null; // the timer of an answer that does not come
  #means = new Map(); // of textures, as far as they are known

  // `root` is the panel's element; `acts` the editor; `mean(texture, reads)` resolves to
  // a texture's mean; `close()` hides the panel.
  constructor(root, { acts, schema, mean, titles, close }) {
    Object.assign(this, { root, acts, mean, titles });
    this.models = materialModels(schema.scene);
    this.schema = schema.scene;
    this.views = Object.keys(VIEWS);
    this.#build(close);
    new ResizeObserver(() => this.#draw()).observe(this.plot);
  }

  get #view() {
    return VIEWS[this.#options.view];
  }

  #build(close) {
    const id = freshId("incidence");
    this.title = element("h2", {});
    const views = element(
      "div",
      { class: "cluster", role: "radiogroup", "aria-label": "What is plotted" },
      ...this.views.map((name) =>
        element(
          "button",
          { type: "button", role: "radio", class: "button small", "data-value": name },
          VIEWS[name].title,
        ),
      ),
    );
    this.markView = watchChoice(views, "button", ({ dataset }) => this.#set({ view: dataset.value }));
    this.plot = element("div", { class: "lobe-plot" });
    this.reading = element("p", { class: "lobe-reading", "aria-hidden": "true" });
    this.plot.addEventListener("pointerleave", () => {
      this.reading.textContent = "";
    });
    this.angle = element("input", {
      type: "range",
      id,
      min: "0",
      max: "89.5",
      step: "0.5",
      oninput: () => this.#set({ incidence: this.#inRange(this.angle.valueAsNumber) }),
    });
    slideByTouch(this.angle, {
      input: (incidence) => this.#set({ incidence: this.#inRange(incidence) }),
      commit() {},
    });
    this.degrees = element("output", { for: id });
    this.angleRow = element(
      "div",
      { class: "field lobe-angle" },
      element("label", { for: id }, "Incidence"),
      this.angle,
      this.degrees,
    );
    const check = (title, change) => {
      const box = element("input", { type: "checkbox", class: "toggle", onchange: () => change(box.checked) });
      return { box, row: element("label", {}, box, title) };
    };
    this.log = check("Logarithmic", (isLog) => this.#set({ isLog }));
    this.colors = check("Red, green, blue", (isRgb) => this.#set({ channels: isRgb ? "rgb" : "luminance" }));
    this.lobes = check("By lobe", (byLobe) => this.#set({ byLobe }));
    this.legend = element("p", { class: "lobe-legend" });
    this.note = element("p", { class: "note" });
    this.replaced = element("p", { class: "note" });
    this.trouble = element("p", { class: "note", role: "status", hidden: true });
    this.table = new Table();
    const save = (title, does) => element("button", { type: "button", class: "button small", onclick: does }, title);
    this.files = element(
      "div",
      { class: "row" },
      save("Save SVG", () =>
        this.#save("svg", "image/svg+xml", () =>
          standalone(this.plot.firstElementChild, getComputedStyle(this.root).backgroundColor),
        ),
      ),
      save("Save CSV", () => this.#save("csv", "text/csv", () => csv(this.#shown.view.table(this.#shown.data)))),
    );
    this.root.append(
      element(
        "header",
        { class: "lobe-head" },
        this.title,
        views,
        element(
          "button",
          { type: "button", class: "button icon", "aria-label": "Close the lobe", onclick: close },
          "×",
        ),
      ),
      this.plot,
      this.reading,
      this.trouble,
      this.angleRow,
      element("div", { class: "checks" }, this.log.row, this.lobes.row, this.colors.row),
      this.legend,
      this.note,
      this.replaced,
      this.table.element,
      this.files,
    );
    this.#watchHand();
  }

  // A hand on the plot sets the angle of incidence, or turns the solid; so do the arrows while the plot has the focus.
  #watchHand() {
    watchHand(this.plot, {
      isPossible: () => this.#shown !== null,
      drag: (event, last) => this.#drag(event, last),
      read: (event) => this.#read(event),
      step: (right, up) => {
        if (this.#view.turns) this.#turn(right * KEY_TURN, up * KEY_TURN);
        else if (this.#view.hasIncidence)
          this.#set({ incidence: this.#inRange(this.#options.incidence + right + up) });
      },
    });
  }

  #drag({ clientX, clientY }, last) {
    if (this.#view.turns) this.#turn(-(clientX - last.x) * TURN, (clientY - last.y) * TURN);
    if (this.#view !== polar || this.#shown.view !== polar) return;
    const { left, top } = this.plot.getBoundingClientRect();
    this.#set({
      incidence: this.#inRange(Math.abs(angleAt(this.#shown.data, this.#drawn(), clientX - left, clientY - top))),
    });
  }

  // What the curves say at the mouse.
  #read({ clientX, clientY, pointerType }) {
    const isRead = pointerType === "mouse" && this.#view === polar && this.#shown?.view === polar;
    const { left, top } = this.plot.getBoundingClientRect();
    this.reading.textContent = isRead
      ? readingAt(this.#shown.data, this.#drawn(), clientX - left, clientY - top)
      : "";
  }

  // Not along the surface, where there is no side.
  #inRange(angle) {
    const inside = Math.min(Math.max(angle, 0), Number(this.angle.max));
    return inside > 89.5 && inside < 90.5 ? (inside < 90 ? 89.5 : 90.5) : inside;
  }

  #turn(right, up) {
    const { turn, height } = this.#options;
    Object.assign(this.#options, { turn: turn + right, height: Math.min(Math.max(height + up, LOWEST), -LOWEST) });
    this.#draw();
  }

  #set(options) {
    Object.assign(this.#options, options);
    this.refresh();
  }

  // The options of a drawing, with its size.
  #drawn() {
    return { ...this.#options, size: { width: this.plot.clientWidth, height: this.plot.clientHeight } };
  }

  #save(ending, mime, make) {
    if (this.#shown)
      saveAs(
        new Blob([make()], { type: mime }),
        `sunbox-${this.#options.view}-${this.acts.state.chosen.material}.${ending}`,
      );
  }

  // The variants of the selected material without textures: {materials: {a, b?}, replaced}.
  #materials() {
    const { chosen, scene } = this.acts.state;
    const { compared: compare } = this.acts;
    const isCompared = compare?.material === chosen.material;
    const documents = { a: scene.materials[chosen.material], ...(isCompared ? { b: compare.document } : {}) };
    const replaced = new Set();
    const materials = Object.fromEntries(
      Object.entries(documents)
        .filter(([, document]) => document)
        .map(([side, document]) => {
          const own = fields(this.schema, this.models[document.type]);
          this.#learn(texturesOf(document, own), scene.textures ?? {});
          const made = plain(
            document,
            own,
            (texture, reads) => this.#means.get(JSON.stringify([scene.textures?.[texture], reads])) ?? [1, 1, 1, 1],
          );
          made.replaced.forEach((title) => replaced.add(title));
          return [side, made.material];
        }),
    );
    return { materials, replaced: [...replaced] };
  }

  // Finds the means of textures that are new, and asks again with them.
  #learn(used, textures) {
    for (const { texture, reads } of used) {
      const key = JSON.stringify([textures[texture], reads]);
      if (this.#means.has(key) || !textures[texture]) continue;
      this.#means.set(key, null);
      this.mean(textures[texture], reads, textures).then((mean) => {
        this.#means.set(key, mean);
        this.refresh();
      });
    }
  }

  // Shows the state of the editor; asks the server where that needs numbers that are not here.
  refresh() {
    if (this.root.hidden) return;
    const { view, incidence, isLog, channels, byLobe } = this.#options;
    if (!this.#shown) this.table.element.open = this.root.clientHeight > ROOMY;
    const { materials, replaced } = this.#materials();
    this.title.textContent = `Lobe of ${inWords(this.acts.state.chosen.material)}`;
    this.markView(({ dataset }) => dataset.value === view);
    this.angleRow.hidden = !this.#view.hasIncidence;
    this.angle.value = String(incidence);
    this.angle.style.setProperty("--share", String(incidence / Number(this.angle.max)));
    this.angle.setAttribute("aria-valuetext", `${incidence}°`);
    this.degrees.textContent = `${incidence}°`;
    this.log.row.hidden = !this.#view.hasLog;
    this.log.box.checked = isLog;
    this.lobes.row.hidden = !this.#view.hasLobes;
    this.lobes.box.checked = byLobe;
    this.colors.row.hidden = !this.#view.hasChannels;
    this.colors.box.checked = channels === "rgb";
    this.replaced.hidden = !replaced.length;
    this.replaced.textContent = `The plot uses the average of the images of ${replaced.map((title) => title.toLowerCase()).join(", ")}.`;
    this.plot.classList.toggle("turns", Boolean(this.#view.turns));
    this.plot.classList.toggle("aims", this.#view === polar);
    this.plot.classList.toggle("tall", this.#view === terms);
    // No view reads what it does not show: another angle asks for no new albedo.
    const key = JSON.stringify([
      view,
      materials,
      this.#view.hasIncidence ? incidence : null,
      this.#view.hasLobes ? byLobe : null,
    ]);
    if (key === this.#wanted) return this.#draw();
    this.#wanted = key;
    this.root.setAttribute("aria-busy", "true");
    this.#await();
    const options = { ...this.#options };
    this.#latest.want((isStale) => this.#load(VIEWS[view], materials, options, isStale));
    return undefined;
  }

  async #load(view, materials, options, isStale) {
    try {
      const each = async (load) =>
        Object.fromEntries(
          await Promise.all(
            Object.entries(materials).map(async ([side, material]) => [side, await load(side, material)]),
          ),
        );
      let data = await each((_, material) => view.first(askBsdf, material, options));
      this.#answered();
      if (isStale()) this.#await();
      this.#show(view, data);
      if (!isStale()) this.root.setAttribute("aria-busy", "false"); // the newest that was wanted; finer curves may follow
      await new Promise((resolve) => {
        setTimeout(resolve, view.finer ? REFINE_REST_MS : 0);
      });
      for (let round = 0, isBetter = true; view.finer && isBetter && !isStale(); round += 1) {
        isBetter = false;
        const last = data;
        data = await each(async (side, material) => {
          const better = await view.finer(askBsdf, material, last[side], options, round);
          isBetter ||= better !== null;
          return better ?? last[side];
        });
        if (isBetter && !isStale()) this.#show(view, data);
      }
    } catch (problem) {
      this.#answered();
      this.root.setAttribute("aria-busy", "false");
      if (problem.status !== 422) this.#wanted = null; // asked for again with the next change of anything
      this.#data = null;
      this.trouble.hidden = false;
      this.trouble.textContent = problemText(problem, this.titles);
      this.plot.replaceChildren();
    }
  }

  #await() {
    this.#waiting ??= setTimeout(() => this.plot.classList.add("stale"), STALE_MS);
  }

  #answered() {
    clearTimeout(this.#waiting);
    this.#waiting = null;
    this.plot.classList.remove("stale");
  }

  #show(view, data) {
    this.#data = data;
    this.#shown = { view, data };
    this.trouble.hidden = true;
    const isWhole =
      Object.values(data).some((own) => own.lower?.length) || (view === polar && Object.values(data).some(isBelow));
    this.angle.max = isWhole || this.#options.incidence > 90 ? "180" : "89.5"; // from inside, where light gets through
    this.#draw();
  }

  #draw() {
    if (this.root.hidden || !this.#shown || !this.plot.clientWidth) return;
    const { view, data } = this.#shown;
    const options = this.#drawn();
    const drawn = view.draw(data, options);
    // The plot takes the focus for its arrows, where they do something.
    this.plot.tabIndex = view.turns || view === polar ? 0 : -1;
    this.plot.replaceChildren(drawn);
    this.note.textContent = view.note?.(data, options) ?? "";
    this.note.hidden = !this.note.textContent;
    const { scene, chosen } = this.acts.state;
    const { compared: compare } = this.acts;
    const models = { a: scene.materials[chosen.material]?.type, b: compare?.document.type };
    this.legend.replaceChildren(...legend(view, data, this.#options.channels, models));
    this.colors.row.classList.toggle(
      "dim",
      Object.values(data).every(({ f, albedo: all }) => isGrey(f ?? all ?? [])),
    );
    this.table.show(view, data);
  }
}
