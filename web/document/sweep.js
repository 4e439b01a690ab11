// A sweep: the material in hand with one of its parameters at several values along its range, or from one to another.

import { visible } from "./outline.js";
import { colorsBetween, endsRound } from "./sweep-colors.js";
import { linear } from "../lib/color.js";
import { equal, isObject, pointer, put } from "../lib/patch.js";
import { endsOf, span } from "../lib/span.js";
import { followed } from "../server/schema.js";

const COUNT = 7; // pictures: as many as stand beside each other and still tell something
const AREA = 128 * 128; // pixels of each
const SETTINGS = { max_samples: 32, resolution_scale: 1, denoise: true };
const PRIORITY = 1; // somebody looks on: it takes seconds, and goes before final pictures, which take minutes

const NUMBERS = ["slider", "number", "amount"];

// What a field of the material has, or undefined where neither it nor the schema says. `own` are its model's fields.
const valueOf = (own, material, name) => material[name] ?? own.find((field) => field.name === name)?.initial;

export const isColor = ({ widget }) => widget === "color";
const isTriple = ({ widget }) => widget === "amounts";
const isTextured = (value) => isObject(value) && value.texture !== undefined;

// The fields that can be swept: colours, and numbers with a range; of use with the choices made, and not in a texture's hands.
export const sweepable = (own, material) =>
  own.filter(
    (field) =>
      (isColor(field) || isTriple(field) || (NUMBERS.includes(field.widget) && isRange(field.soft))) &&
      !isTextured(material[field.name]) &&
      (!field.used || field.used.values.includes(valueOf(own, material, field.used.field))),
  );

const isRange = ({ min, max }) => Number.isFinite(max - min);

// The parameter with which a sweep begins: the one that was touched last, else one that this material is about.
export function firstOf(offered, material, touched) {
  const isSaid = ({ name, initial }) => material[name] !== undefined && material[name] !== initial;
  return (
    offered.find(({ name }) => name === touched) ??
    offered.find((field) => !isColor(field) && isSaid(field)) ??
    offered.find((field) => !isColor(field)) ??
    offered[0]
  );
}

// The value that a field has now, or undefined.
export const presentValue = (own, material, field) =>
  valueOf(own, material, field.name) ?? followed(field, valueOf(own, material, field.follows?.field));

// Along what a field of numbers is swept: as its slider goes.
function rangeOf(own, material, { soft, log, ranges, step }) {
  const ends = ranges ? endsOf({ ranges, soft }, valueOf(own, material, ranges.field)) : soft;
  return span({ ...ends, min: ends.min ?? log }, step, Boolean(ranges), log);
}

// The number of a value that a sweep is of: of a triple its greatest; and the value with another one.
const numberOf = (field, value) => (isTriple(field) && value !== undefined ? Math.max(...linear(value)) : value);

function withNumber(field, present, number) {
  if (!isTriple(field)) return number;
  const now = linear(present ?? 1);
  const most = Math.max(...now) || 1;
  return now.map((x) => Number(((number * x) / most).toPrecision(4)));
}

// From where to where a field is swept if nobody says: {from, to}, numbers, or linear colours.
export function sweepEnds(own, material, field) {
  const present = presentValue(own, material, field);
  if (isColor(field)) {
    const [from, to] = endsRound(tintOf(present ?? 0.5));
    return { from, to };
  }
  const { min, max, isLog } = rangeOf(own, material, field);
  return { from: isLog && field.log ? Math.max(min, field.log) : min, to: max };
}

// Values along a field's range, rising; the present one is among them where it lies between the ends, in the place of its
// neighbour. `ends`: {from, to} as sweepEnds has them.
export function sweepValues(own, material, field, ends = sweepEnds(own, material, field)) {
  const present = presentValue(own, material, field);
  if (isColor(field)) return colorValues(present, ends, equal(ends, sweepEnds(own, material, field)));
  return numbersBetween(own, material, field, ends, numberOf(field, present)).map((number) =>
    withNumber(field, present, number),
  );
}

function numbersBetween(own, material, field, { from, to }, present) {
  const { open, step, log, ranges } = field;
  const usual = sweepEnds(own, material, field);
  const isWhole = from === usual.from && to === usual.to;
  const [min, max] = [Math.min(from, to), Math.max(from, to)];
  const range = span({ min, max }, step, Boolean(ranges), log && (min > 0 ? min : log));
  const { isLog } = range;
  const fine = isWhole || field.whole ? step : Math.min(step, 10 ** Math.floor(Math.log10((max - min) / 60)));
  const valueAt = (share) =>
    isLog ? range.fromShare(share) : Number((Math.round((min + share * (max - min)) / fine) * fine).toPrecision(12));
  // A bound that does not belong to the range: the last value stands one step before it.
  const inside = (value) =>
    value <= open.min ? open.min + step : value >= open.max ? open.max - step : Math.min(Math.max(value, min), max);
  const even = [...new Set(Array.from({ length: COUNT }, (_, i) => inside(valueAt(i / (COUNT - 1)))))];
  if (typeof present !== "number" || even.includes(present)) return even;
  const isBetween = present > even[0] && present < even.at(-1);
  if (!isWhole && !isBetween) return even;
  const distance = isLog
    ? (value) => Math.abs(range.toShare(value) - range.toShare(present))
    : (value) => Math.abs(value - present);
  const inner = even.slice(1, -1);
  const nearest = inner.reduce((best, each) => (distance(each) < distance(best) ? each : best), inner[0]);
  return [...even.filter((value) => !isBetween || value !== nearest), present].sort((a, b) => a - b);
}

const tintOf = (value) => {
  const now = linear(value);
  const most = Math.max(1, ...now);
  return now.map((x) => x / most);
};

// From one colour to the other, as strong as the present one, which stands in the place of the one most like it. Ends that
// somebody has chosen stay.
function colorValues(present, { from, to }, isWhole) {
  const now = present === undefined ? null : linear(present);
  const strength = Math.max(1, ...(now ?? []));
  const even = colorsBetween(from, to, COUNT).map((rgb) => rgb.map((x) => Number((x * strength).toPrecision(4))));
  if (!now) return even;
  const far = (rgb) => Math.hypot(...rgb.map((x, i) => x - now[i]));
  const nearest = even.reduce((best, each) => (far(each) < far(best) ? each : best));
  const isEnd = nearest === even[0] || nearest === even.at(-1);
  return even.map((rgb) => (rgb === nearest && (isWhole || !isEnd) ? present : rgb));
}

// The batch that renders it: the picture on the page, whose sides are `size`, but small.
export function sweepOrder({ scene, settings, chosen }, { material, name, values, size }) {
  const { time_limit, target_noise, ...kept } = settings;
  const across = Math.sqrt(AREA * (size.width / size.height));
  const sides = { width: Math.max(16, Math.round(across)), height: Math.max(16, Math.round(AREA / across)) };
  const place = pointer("materials", chosen.material);
  return {
    scene: visible(put(scene, place, material), chosen.hidden),
    settings: { ...kept, ...SETTINGS, ...sides },
    over: [{ path: `${place}${pointer(name)}`, values }],
    priority: PRIORITY,
  };
}
