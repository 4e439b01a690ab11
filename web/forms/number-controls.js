// Numbers: a field to write into, a slider, and both beside each other. The events are those of controls.js.

import { element, isBeingEdited } from "../lib/dom.js";
import { slideByTouch } from "../lib/sliding.js";
import { neededIn, parseNumber } from "../lib/number.js";
import { compact, unitText } from "../lib/format-text.js";
import { span } from "../lib/span.js";

export const UNSET = "–"; // neither document nor schema has a value
const ROOM = { narrow: 7, wide: 20 }; // letters that a box shows of what holds where it is empty

// What an empty box says of the value that holds: its word, where that has room.
export const placeholder = ({ absent = UNSET }, room) => (absent.length > ROOM[room] ? "auto" : absent);

// A number of a field with its unit.
export const withUnit = (field, value) => `${compact(value)} ${unitText(field.unit)}`.trim();
const wordsOf = (field) => field.words ?? field.write ?? ((value) => withUnit(field, value));

// What a field of the schema says of its slider.
export const scaleOf = (field, ends = field.soft) => span(ends, field.step, Boolean(field.ranges), field.log);

// A text field: one of type=number swallows what it does not understand, such as the comma of 0,35. Only where
// a value is never negative may a phone show its keys for decimals: those have no minus. A field may have words of its own
// for its numbers: `write(value)`, `read(text, value)` with the value that stands there, and what is `needed`; `words(value)`
// where what is read out is longer.
export function numberEntry(field, id, { input, commit, refuse, restore }, room = "narrow") {
  const unit = unitText(field.unit);
  const { write = compact, read = (text) => parseNumber(text, unit), needed = neededIn(unit) } = field;
  const words = wordsOf(field);
  let latest = null;
  let holds = null; // the same, or what holds in its place
  let scale = scaleOf(field);
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
    const value = read(box.value, holds);
    if (value === null) return refuse(needed);
    input(value);
    commit();
  };
  const now = () =>
    [read(box.value, holds), latest, read(box.placeholder, holds), field.initial, field.soft.min, 0].find(
      (each) => typeof each === "number",
    );
  const { min = -Infinity, max = Infinity, open } = field;
  const give = (value) => {
    const to = Number(value.toPrecision(12));
    if (to < min || to > max || to <= open.min || to >= open.max) return;
    clean();
    input(to);
    box.value = write(to);
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
    move: (steps) => {
      const size = scale.stepAt(begun.from);
      const to = Math.round(begun.from / size + steps) * size; // no more digits than the hand has
      give(Math.min(Math.max(to, min), max));
    },
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
    inputmode: field.min >= 0 && !field.write ? "decimal" : undefined,
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
    scale = scaleOf(field, ends);
    box.placeholder = effective === undefined ? placeholder(field, room) : write(effective);
    holds = latest ?? effective ?? null;
    if (typeof holds === "number") {
      box.setAttribute("role", "spinbutton");
      box.setAttribute("aria-valuenow", String(holds));
      box.setAttribute("aria-valuetext", words(holds));
    } else ["role", "aria-valuenow", "aria-valuetext"].forEach((name) => box.removeAttribute(name));
    if (isBeingEdited(box)) return;
    box.value = latest === null ? "" : write(latest);
    if (latest === null) box.title = effective === undefined ? (field.absent ?? "") : "";
    else box.title = box.value === String(latest) ? "" : String(latest);
  };
  return { element: box, show, drag };
}

export function track(field, id, { input, commit }) {
  let scale = null;
  // A bound that does not belong to the range: the slider stops one step before it.
  const inside = (at) => {
    const value = scale.isLog ? scale.fromShare(at) : at;
    if (value <= field.open.min) return field.open.min + field.step;
    return value >= field.open.max ? field.open.max - field.step : value;
  };
  const words = wordsOf(field);
  const range = element("input", {
    type: "range",
    id,
    oninput: () => input(inside(range.valueAsNumber)),
    onchange: commit,
  });
  const over = (ends) => {
    if (scale && ends.min === scale.min && ends.max === scale.max) return;
    scale = scaleOf(field, ends);
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
    const number = known === null ? (field.absent ?? "") : words(known);
    const told = (value ?? null) !== null ? number : ["not set", number].filter(Boolean).join(", ");
    range.setAttribute("aria-valuetext", told);
  };
  return { element: range, show };
}

export function slider(field, id, events) {
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
