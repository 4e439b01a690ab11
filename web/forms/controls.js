// The widgets of a form: each has an `element`, shows a value, and calls `input` with a new one while
// the hand moves and `commit` when it comes to rest. `undefined` stands for "as the server likes". `refuse`
// says what was wrong with something written, `restore` goes back to the value there was.

import { hex, linear, measureWords, parseColor } from "../lib/color.js";
import { element, isBeingEdited } from "../lib/dom.js";
import { slideByTouch } from "../lib/sliding.js";
import { neededIn, parseNumber, parseTriple } from "../lib/number.js";
import { compact, inWords, unitText } from "../lib/format-text.js";
import { scrubBy } from "../lib/scrub.js";
import { span } from "../lib/span.js";

const STOPS = 8; // below and above 1 of the unit: how far a slider of strengths goes at least
const exact = (x) => Number(x.toPrecision(5));
const UNSET = "–"; // neither document nor schema has a value
const ROOM = { narrow: 7, wide: 20 }; // letters that a box shows of what holds where it is empty

// What an empty box says of the value that holds: its word, where that has room.
const placeholder = ({ absent = UNSET }, room) => (absent.length > ROOM[room] ? "auto" : absent);

// A text field: one of type=number swallows what it does not understand, such as the comma of 0,35. Only where
// a value is never negative may a phone show its keys for decimals: those have no minus.
function numberEntry(field, id, { input, commit, refuse, restore }, room = "narrow") {
  const unit = unitText(field.unit);
  let latest = null;
  let scale = span(field.soft, field.step, Boolean(field.ranges));
  const clean = () => {
    delete box.dataset.dirty;
  };
  const take = () => {
    clean();
    if (box.value.trim() === "") {
      if (field.required) return restore();
      input(undefined);
      return commit();
    }
    const value = parseNumber(box.value, unit);
    if (value === null) return refuse(neededIn(unit));
    input(value);
    commit();
  };
  const now = () =>
    parseNumber(box.value, unit) ?? latest ?? parseNumber(box.placeholder) ?? field.initial ?? field.soft.min ?? 0;
  const { min = -Infinity, max = Infinity, open } = field;
  const give = (value) => {
    const to = Number(value.toPrecision(12));
    if (to < min || to > max || to <= open.min || to >= open.max) return;
    clean();
    input(to);
    box.value = compact(to);
  };
  const step = (steps) => {
    const from = now();
    give(from + steps * scale.stepAt(from));
    box.select();
  };
  let begun = null; // {latest, from}: where a drag of the label began
  const drag = {
    begin: () => {
      begun = { latest, from: latest ?? now() };
    },
    move: (steps) => give(Math.min(Math.max(begun.from + steps * scale.stepAt(begun.from), min), max)),
    end: commit,
    cancel: () => {
      input(begun.latest ?? undefined);
      commit();
    },
  };
  const box = element("input", {
    type: "text",
    id,
    class: "entry number",
    autocomplete: "off",
    spellcheck: "false",
    inputmode: field.min >= 0 ? "decimal" : undefined,
    oninput: () => {
      box.dataset.dirty = "yes";
    },
    onblur: clean,
    onkeydown: (event) => {
      if (event.key === "Escape") {
        clean();
        restore();
      }
      const up = { ArrowUp: 1, ArrowDown: -1 }[event.key];
      if (!up || event.altKey || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      step(up * (event.shiftKey ? 10 : 1));
    },
    onkeyup: ({ key }) => {
      if (key === "ArrowUp" || key === "ArrowDown") commit();
    },
    onchange: take,
  });
  const show = (value, effective, ends = field.soft) => {
    latest = value ?? null;
    scale = span(ends, field.step, Boolean(field.ranges));
    box.placeholder = effective === undefined ? placeholder(field, room) : compact(effective);
    const holds = latest ?? effective;
    if (typeof holds === "number") {
      box.setAttribute("role", "spinbutton");
      box.setAttribute("aria-valuenow", String(holds));
      box.setAttribute("aria-valuetext", `${compact(holds)} ${unit}`.trim());
    } else ["role", "aria-valuenow", "aria-valuetext"].forEach((name) => box.removeAttribute(name));
    if (isBeingEdited(box)) return;
    box.value = latest === null ? "" : compact(latest);
    if (latest === null) box.title = effective === undefined ? (field.absent ?? "") : "";
    else box.title = box.value === String(latest) ? "" : String(latest);
  };
  return { element: box, show, drag };
}

function track(field, id, { input, commit }) {
  let scale = null;
  // A bound that does not belong to the range: the slider stops one step before it.
  const inside = (at) => {
    const value = scale.isLog ? scale.fromShare(at) : at;
    if (value <= field.open.min) return field.open.min + field.step;
    return value >= field.open.max ? field.open.max - field.step : value;
  };
  const range = element("input", {
    type: "range",
    id,
    oninput: () => input(inside(range.valueAsNumber)),
    onchange: commit,
  });
  const over = (ends) => {
    if (scale && ends.min === scale.min && ends.max === scale.max) return;
    scale = span(ends, field.step, Boolean(field.ranges));
    const [min, max] = scale.isLog ? [0, 1] : [ends.min, ends.max];
    Object.assign(range, { min: String(min), max: String(max), step: String(scale.step) });
  };
  over(field.soft);
  slideByTouch(range, { input: (value) => input(inside(value)), commit });
  // A slider without a value stands, as a ghost, where the one is that holds; without either it has no thumb.
  const show = (value, effective, ends = field.soft) => {
    over(ends);
    const [min, max] = [Number(range.min), Number(range.max)];
    const known = value ?? effective ?? null;
    range.classList.toggle("ghost", (value ?? null) === null);
    range.classList.toggle("unset", known === null);
    range.value = String(known === null ? min : scale.isLog ? scale.toShare(known) : known);
    range.style.setProperty("--share", String((range.valueAsNumber - min) / (max - min)));
    const number = known === null ? (field.absent ?? "") : `${compact(known)} ${unitText(field.unit)}`.trim();
    const words = (value ?? null) !== null ? number : ["not set", number].filter(Boolean).join(", ");
    range.setAttribute("aria-valuetext", words);
  };
  return { element: range, show };
}

function slider(field, id, events) {
  const range = track(field, id, events);
  const entry = numberEntry(field, `${id}-entry`, events);
  entry.element.setAttribute("aria-label", `${field.title}, number`);
  return {
    element: element("div", { class: "slider" }, range.element, entry.element),
    drag: entry.drag,
    show(value, effective, ends) {
      range.show(value, effective, ends);
      entry.show(value, effective, ends);
    },
  };
}

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
    const entry = numberEntry({ ...field, required: true }, i === 0 ? id : `${id}-${axis}`, {
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
function strengthControl(field, id, events) {
  const named = (title, more) => ({ ...field, title, ranges: true, initial: undefined, ...more });
  const title = `${field.title}, strength`;
  const ends = { min: 2 ** -STOPS, max: 2 ** STOPS };
  const range = track(named(title, { soft: ends }), `${id}-strength`, events);
  const stops = numberEntry(
    named(title, { unit: "", min: undefined, max: undefined, open: {}, soft: {}, ranges: undefined, step: 0.1 }),
    `${id}-stops`,
    { ...events, input: (value) => events.input(value === undefined ? undefined : exact(2 ** value)) },
  );
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

const bounded = ({ soft }) => Number.isFinite(soft.max - soft.min);

export function control(field, id, events) {
  if (field.widget === "color") return color(field, id, events);
  if (field.widget === "strength") return strengthControl(field, id, events);
  if (field.widget === "vector") return vector(field, id, events);
  if (field.widget === "texture") return { element: element("span", { id }), show() {} }; // its slot is all there is
  if (field.widget === "file") return fileEntry(id, events);
  if (field.widget === "choice") return choice(field, id, events);
  if (field.widget === "toggle") return toggle(field, id, events);
  if (field.widget === "number" || !bounded(field)) return numberEntry(field, id, events, "wide");
  return slider(field, id, events);
}
