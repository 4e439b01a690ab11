// "Sweep a parameter": the picture with one parameter of the material in hand at values along its range, side by side.
// A click takes one. The server renders them as one batch, which ends with the dialog.

import { firstOf, isColor, presentValue, sweepable, sweepEnds, sweepOrder, sweepValues } from "../document/sweep.js";
import { users } from "../document/materials.js";
import { amountWords } from "../forms/amounts.js";
import { SweepEnds } from "../forms/sweep-ends.js";
import { show } from "../forms/thumbnails.js";
import { hex, linear } from "../lib/color.js";
import { element, freshId } from "../lib/dom.js";
import { amount, compact, inWords, unitText } from "../lib/format-text.js";
import { equal } from "../lib/patch.js";
import { PictureList } from "../lib/picture-list.js";
import { cancelBatch, batchStatus, renderImage, startBatch } from "../server/api.js";
import { fieldTitles, problemText } from "../server/problem-text.js";
import { fields, materialModels } from "../server/schema.js";

const WATCH_MS = 400; // between two looks at what is done
const ENDED = ["done", "cancelled", "failed"];

const pause = (ms) =>
  new Promise((wake) => {
    setTimeout(wake, ms);
  });

// What is wrong with a value is told of its place in the batch; the person knows the material's.
function ofMaterial(problem) {
  problem.errors = problem.errors?.map(({ pointer, detail }) => {
    const [, place, told] = /^(\/scene\/.*?): (.*)$/s.exec(detail) ?? [];
    return place ? { pointer: place, detail: told } : { pointer, detail };
  });
  return problem;
}

// One batch, from its start to when it is left.
class Batch {
  isLeft = false;
  #id = null;

  // `came(i, blob)` with each picture, `failed()` where there will be none.
  async run(order, view, { came, failed }) {
    const { id } = await startBatch(order);
    this.#id = id;
    if (this.isLeft) return this.#cancel();
    const seen = new Set();
    for (;;) {
      const { state, renders } = await batchStatus(id);
      for (const [i, render] of renders.entries()) {
        if (this.isLeft) return;
        if (seen.has(i) || !ENDED.includes(render.state)) continue;
        seen.add(i);
        if (render.state === "done") came(i, await renderImage(render.id, { format: "webp", ...view }));
        else failed();
      }
      if (ENDED.includes(state)) return;
      await pause(WATCH_MS);
      if (this.isLeft) return;
    }
  }

  // Nobody wants it any more: the server cancels it, or deletes what has ended.
  leave() {
    if (this.isLeft) return;
    this.isLeft = true;
    if (this.#id) this.#cancel();
  }

  #cancel() {
    cancelBatch(this.#id).catch(() => {}); // an unreachable server forgets it in time
  }
}

export class Sweep {
  // `acts` is the editor; `page` knows the picture's size and view; `say(text)` reads out.
  constructor({ schema, page, acts, say }) {
    Object.assign(this, { page, acts, say });
    this.schema = schema.scene;
    this.models = materialModels(schema.scene);
    this.titles = fieldTitles(schema.scene, schema.settings);
  }

  // `name` is of the parameter that is swept at first, if it can be; `from` gets the keyboard back.
  open(name, from) {
    const { material, materialPlace: place, state } = this.acts;
    const own = fields(this.schema, this.models[material.type]);
    const offered = sweepable(own, material);
    if (!offered.length) return this.acts.complain(new Error("This material has no parameter to try."));
    const id = freshId("sweep");
    const select = element("select", { id: `${id}-of`, onchange: () => choose() }, ...options(offered));
    select.value = firstOf(offered, material, name).name;
    const row = element("div", { class: "sweep" });
    const ends = new SweepEnds(() => sweep());
    const status = element("p", { class: "note", role: "status" });
    const trouble = element("p", { class: "trouble", role: "alert", hidden: true });
    const unused = users(state.scene, state.chosen.material).length === 0;
    const dialog = element(
      "dialog",
      { class: "dialog sweeping", "aria-labelledby": id },
      element(
        "header",
        {},
        element("h2", { id }, `Sweep a parameter of ${state.chosen.material}`),
        element("button", { type: "button", class: "button small", onclick: () => dialog.close() }, "Close"),
      ),
      element("div", { class: "row" }, element("label", { for: `${id}-of` }, "Parameter"), select, ends.element),
      unused ? element("p", { class: "note" }, "No thing wears this material, so all pictures look alike.") : null,
      row,
      status,
      trouble,
    );
    let batch = null;
    const swept = () => offered.find((each) => each.name === select.value);
    const choose = () => {
      ends.show(swept(), sweepEnds(own, material, swept()));
      sweep();
    };
    const sweep = () => {
      batch?.leave();
      batch = new Batch();
      const field = swept();
      this.#fill({ batch, row, status, trouble, own, material, field, ends: ends.value }, (value) => {
        dialog.close();
        if (equal(value, presentValue(own, material, field))) return;
        this.acts.edit(`${place}/${field.name}`, value, null);
        this.say(`${field.title}: ${words(field, value)}`);
      });
    };
    const leave = () => batch.leave();
    addEventListener("pagehide", leave);
    dialog.addEventListener("close", () => {
      removeEventListener("pagehide", leave);
      leave();
      dialog.remove();
      // The browser gives it to what had it before: nothing, where its code came after the menu was gone.
      if (document.activeElement === document.body) from.focus();
    });
    document.body.append(dialog);
    choose();
    dialog.showModal();
  }

  async #fill({ batch, row, status, trouble, own, material, field, ends }, take) {
    const present = presentValue(own, material, field);
    const values = sweepValues(own, material, field, ends);
    const keyOf = (value) => (typeof value === "number" ? String(value) : JSON.stringify(value));
    const { size, view } = this.page;
    const list = element("div", {
      class: "tiles",
      role: "listbox",
      "aria-label": `Sweep of ${field.title}`,
      "aria-busy": "true",
    });
    row.style.setProperty("--shape", `${size.width} / ${size.height}`);
    row.replaceChildren(list);
    trouble.hidden = true;
    const images = [];
    const pictures = new PictureList(list, { choose: (key) => take(values.find((value) => keyOf(value) === key)) });
    pictures.fill(
      values.map((value) => {
        const told = words(field, value);
        return { value: keyOf(value), title: equal(value, present) ? `${told}, now` : told };
      }),
      (image) => images.push(image),
    );
    pictures.mark(keyOf(present ?? null));
    let [count, lost] = [0, 0];
    const tell = () => {
      status.textContent = `${count} of ${values.length} pictures are rendered.`;
    };
    tell();
    try {
      await batch.run(sweepOrder(this.acts.state, { material, name: field.name, values, size }), view, {
        came: (i, blob) => {
          if (batch.isLeft) return;
          show(images[i], blob);
          count += 1;
          tell();
        },
        failed: () => {
          lost += 1;
        },
      });
    } catch (problem) {
      if (batch.isLeft) return;
      trouble.hidden = false;
      trouble.textContent = problemText(ofMaterial(problem), this.titles);
    }
    if (batch.isLeft) return;
    list.removeAttribute("aria-busy");
    if (lost) status.textContent = `${amount(lost, "picture")} could not be rendered.`;
    else if (count === values.length) status.textContent = "Choose a picture to take its value.";
  }
}

// A value of a field as its picture has it.
function words(field, value) {
  if (isColor(field)) {
    const now = linear(value);
    return hex(now.map((x) => x / Math.max(1, ...now)));
  }
  if (field.log) return amountWords(field, value);
  return `${compact(value)} ${unitText(field.unit)}`.trim();
}

// The fields under the names of their groups.
function options(offered) {
  const groups = Map.groupBy(offered, ({ group }) => group);
  const option = ({ name, title }) => element("option", { value: name }, title);
  return [...groups].flatMap(([group, all]) =>
    group ? [element("optgroup", { label: inWords(group) }, ...all.map(option))] : all.map(option),
  );
}
