// The widgets of a form: each has an `element`, shows a value, and calls `input` with a new one while
// the hand moves and `commit` when it comes to rest. `undefined` stands for "as the server likes". `refuse`
// says what was wrong with something written, `restore` goes back to the value there was.

import { hex, linear, measureWords, parseColor } from "../lib/color.js";
import { element, isBeingEdited } from "../lib/dom.js";
import { parseTriple } from "../lib/number.js";
import { compact, inWords, narrow, unitText } from "../lib/format-text.js";
import { scrubBy } from "../lib/scrub.js";
import { amount, amounts } from "./amounts.js";
import { numberEntry, placeholder, slider, track, withUnit } from "./number-controls.js";

const STOPS = 8; // below and above 1 of the unit: how far a slider of strengths goes at least
const STOP = { unit: "", open: {}, soft: {}, step: 0.1 }; // a number of them
const exact = (x) => Number(x.toPrecision(5));

function choice(field, id, { input, commit }) {
  const select = element("select", {
    id,
    onchange: () => {
      input(select.value || undefined);
      commit();
    },
  });
  if (field.initial === undefined && !field.required) select.append(element("option", { value: "" }, "Automatic"));
  for (const name of field.choices.filter((option) => option !== null)) {
    select.append(element("option", { value: name }, inWords(name)));
  }
  return {
    element: select,
    show: (value) => {
      select.value = value ?? "";
    },
  };
}

// Words for u and v; one word stands for both, in the document and where both are the same.
function choices(field, id, { input, commit }) {
  let latest = [];
  const selects = ["U", "V"].map((axis, i) => {
    const write = (word) => {
      latest = latest.map((old, k) => (k === i ? word : old));
      input(latest[0] === latest[1] ? word : latest);
    };
    const one = choice({ ...field, required: true }, i === 0 ? id : `${id}-${axis}`, { input: write, commit });
    one.element.setAttribute("aria-label", `${field.title}, ${axis}`);
    const letter = element("i", { "aria-hidden": "true" }, axis);
    return { ...one, axis: element("span", { class: "axis", "data-axis": axis }, letter, one.element) };
  });
  return {
    element: element("div", { class: "vector" }, ...selects.map(({ axis }) => axis)),
    show(value) {
      latest = Array.isArray(value) ? value : [value, value];
      selects.forEach((one, i) => one.show(latest[i]));
    },
  };
}

function toggle(field, id, { input, commit }) {
  const box = element("input", {
    type: "checkbox",
    id,
    class: "toggle",
    onchange: () => {
      input(box.checked);
      commit();
    },
  });
  // Neither on nor off where neither document nor schema says: the server decides.
  const show = (value) => {
    Object.assign(box, { checked: Boolean(value), indeterminate: (value ?? null) === null });
  };
  return { element: box, show };
}

// Numbers in a row, three or as two for u and v; a single one stands for all, in the document and where none is set.
function vector(field, id, { input, commit, refuse, restore }) {
  const names = field.length === 2 ? ["U", "V"] : field.isPerChannel ? ["red", "green", "blue"] : ["X", "Y", "Z"];
  let latest = null;
  const entries = names.map((axis, i) => {
    const write = (x) => narrow(x, Math.max(...(latest ?? [0]).map(Math.abs)));
    const own = { ...field, required: true, write, words: (x) => withUnit(field, x) };
    const entry = numberEntry(own, i === 0 ? id : `${id}-${axis}`, {
      input: (value) => input(latest ? latest.map((x, k) => (k === i ? value : x)) : names.map(() => value)),
      commit,
      refuse,
      restore,
    });
    entry.element.setAttribute("aria-label", `${field.title}, ${axis}`);
    return entry;
  });
  return {
    element: element(
      "div",
      { class: "vector" },
      ...entries.map((entry, i) =>
        element(
          "span",
          { class: "axis", "data-axis": names[i] },
          scrubBy(element("i", { "aria-hidden": "true" }, names[i].charAt(0).toUpperCase()), entry.drag),
          entry.element,
        ),
      ),
    ),
    show(value) {
      const known = value ?? (field.isPerChannel ? null : 0);
      latest = Array.isArray(known) || known === null ? known : names.map(() => known);
      entries.forEach((entry, i) => entry.show(latest?.[i]));
    },
  };
}

// Of light: a slider over stops that reaches as far as the value, the stops over 1 of the unit, and the value itself.
export function strengthControl(field, id, events) {
  const named = (title, more) => ({ ...field, title, ranges: true, initial: undefined, ...more });
  const title = `${field.title}, strength`;
  const ends = { min: 2 ** -STOPS, max: 2 ** STOPS };
  const range = track(named(title, { soft: ends }), `${id}-strength`, events);
  const stops = numberEntry({ ...STOP, title }, `${id}-stops`, {
    ...events,
    input: (value) => events.input(value === undefined ? undefined : exact(2 ** value)),
  });
  const entry = numberEntry(named(title, {}), `${id}-strength-entry`, events);
  range.element.setAttribute("aria-label", title);
  stops.element.setAttribute("aria-label", `${title} in stops`);
  entry.element.setAttribute("aria-label", `${title}, number`);
  return {
    element: element(
      "div",
      { class: "slider strength" },
      range.element,
      element("span", { class: "stops" }, stops.element, element("i", { "aria-hidden": "true" }, "stops")),
      entry.element,
    ),
    show(value) {
      // Once it is wider it stays so: it must not become another under the hand.
      if (value > 0) {
        ends.min = Math.min(ends.min, 2 ** (Math.floor(Math.log2(value)) - 2));
        ends.max = Math.max(ends.max, 2 ** (Math.ceil(Math.log2(value)) + 2));
      }
      range.show(value, undefined, { ...ends });
      stops.show(value > 0 ? Number(Math.log2(value).toFixed(2)) : null);
      entry.show(value);
      const told = value > 0 ? `${Number(Math.log2(value).toFixed(1))} stops, ` : "";
      range.element.setAttribute("aria-valuetext", `${told}${compact(value)} ${unitText(field.unit)}`.trim());
    },
  };
}

// Swatch and text; a colour that may pass 1 is split into a tint and a strength.
function color(field, id, { input, commit, refuse, restore }) {
  const bright = !(field.max <= 1);
  let strength = 1;
  let tint = [1, 1, 1];
  let isLinear = false; // what the text shows
  const give = () => input(tint.map((x) => Number((x * strength).toPrecision(5))));

  const swatch = element("input", {
    type: "color",
    id,
    onchange: commit,
    oninput: () => {
      tint = linear(swatch.value);
      if (bright && strength === 0) strength = 1;
      give();
    },
  });
  const text = element("input", {
    type: "text",
    class: "entry",
    spellcheck: "false",
    autocomplete: "off",
    "aria-label": `${field.title}, #rrggbb or three linear numbers`,
    placeholder: placeholder(field, "wide"),
    title: field.absent,
    oninput: () => {
      text.dataset.dirty = "yes";
    },
    onblur: () => {
      delete text.dataset.dirty;
    },
    onkeydown: (event) => {
      if (event.key !== "Escape") return;
      delete text.dataset.dirty;
      restore();
    },
    onchange: () => {
      delete text.dataset.dirty;
      if (text.value === "" && !isSet) return restore();
      const known = parseColor(text.value);
      const triple = parseTriple(text.value);
      if (known) input(known.map((x) => Number((x * (bright ? strength || 1 : 1)).toPrecision(5))));
      else if (triple) input(triple);
      else return refuse("Write #rrggbb, rgb(), hsl(), 2700 K, or three linear numbers such as 0.2 0.4 0.6.");
      commit();
    },
  });
  const mode = element("button", {
    type: "button",
    class: "mode",
    "aria-label": `${field.title}: linear numbers`,
    "aria-pressed": "false",
    onclick: () => {
      isLinear = !isLinear;
      mode.setAttribute("aria-pressed", String(isLinear));
      write();
    },
  });
  let isSet = true;
  let words = null; // of a temperature, or a photometric strength
  const write = () => {
    const numbers = () => (isLinear ? tint.map((x) => compact(x * strength)).join(" ") : hex(tint));
    const shown = isSet ? (words ?? numbers()) : "";
    if (!isBeingEdited(text)) text.value = shown;
    mode.textContent = isLinear ? "lin" : "hex";
  };
  const row = element("div", { class: "color" }, swatch, text, mode);
  const power =
    bright &&
    strengthControl(field, id, {
      input: (value) => {
        strength = value ?? 0;
        give();
      },
      commit,
      refuse,
      restore,
    });

  return {
    element: power ? element("div", {}, row, power.element) : row,
    show(value) {
      isSet = (value ?? null) !== null;
      words = measureWords(value);
      swatch.classList.toggle("unset", !isSet);
      const now = linear(value ?? 0);
      const most = Math.max(...now);
      if (bright) {
        strength = most;
        if (most > 0) tint = now.map((x) => x / most);
        power.show(strength);
      } else tint = now;
      swatch.value = hex(tint);
      write();
    },
  };
}

// A file that the document names by an asset's id; `pick` has the person choose another one.
function fileEntry(id, { pick }) {
  const button = element("button", { type: "button", id, onclick: () => pick() }, "Choose a file…");
  return {
    element: button,
    show(value) {
      button.textContent = value ? "Another file…" : "Choose a file…";
    },
  };
}

// A word, such as a name in a file; an empty one is none.
function textEntry(id, { input, commit, restore }) {
  const clean = () => {
    delete box.dataset.dirty;
  };
  const box = element("input", {
    type: "text",
    class: "entry",
    id,
    autocomplete: "off",
    spellcheck: "false",
    oninput: () => {
      box.dataset.dirty = "yes";
    },
    onchange: () => {
      clean();
      input(box.value.trim() || undefined);
      commit();
    },
    onkeydown: (event) => {
      if (event.key !== "Escape") return;
      clean();
      restore();
    },
  });
  return {
    element: box,
    show(value) {
      if (!isBeingEdited(box)) box.value = value ?? "";
    },
  };
}

const bounded = ({ soft }) => Number.isFinite(soft.max - soft.min);

// A field may come with a way to make its own.
export function control(field, id, events) {
  if (field.make) return field.make(field, id, events);
  if (field.widget === "amounts") return amounts(field, id, events);
  if (field.widget === "amount") return amount(field, id, events);
  if (field.widget === "color") return color(field, id, events);
  if (field.widget === "strength") return strengthControl(field, id, events);
  if (field.widget === "vector") return vector(field, id, events);
  if (field.widget === "texture") return { element: element("span", { id }), show() {} }; // its slot is all there is
  if (field.widget === "file") return fileEntry(id, events);
  if (field.widget === "choices") return choices(field, id, events);
  if (field.widget === "text") return textEntry(id, events);
  if (field.widget === "choice") return choice(field, id, events);
  if (field.widget === "toggle") return toggle(field, id, events);
  if (field.widget === "number" || !bounded(field)) return numberEntry(field, id, events, "wide");
  return slider(field, id, events);
}
