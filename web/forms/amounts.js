// Lengths, and other amounts that go over decades, on a logarithmic slider: one of all, or one for each channel, as the
// greatest of them and the share that each channel has of it.

import { linear } from "../lib/color.js";
import { element } from "../lib/dom.js";
import { compact, unitText } from "../lib/format-text.js";
import { LENGTH_NEEDED, lengthWords, parseLength } from "../lib/lengths.js";
import { slider } from "./number-controls.js";

const CHANNELS = ["Red", "Green", "Blue"];
const SHARE = { unit: "", min: 0, max: 1, soft: { min: 0, max: 1 }, open: {}, step: 0.01, initial: undefined };
const exact = (x) => Number(x.toPrecision(4));
const inPercent = {
  write: (share) => `${Number((100 * share).toPrecision(3))}\u00a0%`,
  read: (text) => parseShare(text),
  needed: "A share is needed here, such as 40 %.",
};

// A number without a sign is in per cent, as what it replaces.
function parseShare(text) {
  const value = Number(text.replace(/\s*%\s*$/, "").replace(",", "."));
  return text.trim() && value >= 0 && value <= 100 ? value / 100 : null;
}

// Whether a field's value tells its own unit, which may be any of length.
export const isLength = ({ widget, unit }) => ["amount", "amounts"].includes(widget) && unit === "m";

// The value of a field of these in words.
export const amountWords = (field, value) => {
  const most = Math.max(...linear(value));
  return field.unit === "m" ? lengthWords(most) : `${compact(most)} ${unitText(field.unit)}`.trim();
};

// The field with the words of its unit.
export const worded = (field) =>
  field.unit === "m" ? { ...field, write: lengthWords, read: parseLength, needed: LENGTH_NEEDED } : field;

// A slider that reaches as far as the value does. Once it is longer it stays so: it must not become another under the hand.
function reaching(field, id, events) {
  const own = slider(worded(field), id, events);
  const ends = { ...field.soft };
  own.element.classList.add("amount");
  return {
    ...own,
    show(value, effective) {
      for (const each of [value, effective])
        if (each > 0) Object.assign(ends, { min: Math.min(ends.min, each), max: Math.max(ends.max, each) });
      own.show(value, effective, { ...ends });
    },
  };
}

export const amount = reaching;

// The three of a triple: their greatest, which the field's title names, and shares below it.
export function amounts(field, id, events) {
  let most = 0;
  let shares = [1, 1, 1];
  const give = () => events.input(shares.map((share) => exact(most * share)));
  const whole = reaching({ ...field, soft: { ...field.soft, min: field.log } }, id, {
    ...events,
    input(value) {
      if (value === undefined) return events.input(undefined);
      most = value;
      give();
    },
  });
  const channels = CHANNELS.map((name, i) => {
    const own = slider({ ...SHARE, ...inPercent, title: `${field.title}, ${name.toLowerCase()}` }, `${id}-${name}`, {
      ...events,
      input(value) {
        shares = shares.map((share, k) => (k === i ? (value ?? 0) : share));
        give();
      },
    });
    own.element
      .querySelector("[type=range]")
      .setAttribute("aria-label", `${field.title}, ${name.toLowerCase()}, share of the greatest`);
    return { name, ...own };
  });
  const rows = element(
    "div",
    { class: "shares" },
    ...channels.map(({ name, element: own }) =>
      element("div", { class: "share", "data-axis": name.toLowerCase() }, element("span", {}, name), own),
    ),
  );
  return {
    element: element("div", { class: "amounts" }, whole.element, rows),
    drag: whole.drag,
    show(value, effective) {
      const isSet = (value ?? null) !== null;
      rows.hidden = !isSet;
      const now = linear(value ?? 0);
      most = Math.max(...now);
      if (most > 0) shares = now.map((each) => each / most);
      whole.show(isSet ? most : value, effective);
      channels.forEach((each, i) => each.show(exact(shares[i])));
    },
  };
}
