// A sweep: the material in hand with one of its parameters at several values along its range.

import { visible } from "./outline.js";
import { isObject, pointer, put } from "../lib/patch.js";
import { endsOf, span } from "../lib/span.js";
import { followed } from "../server/schema.js";

const COUNT = 7; // pictures: as many as stand beside each other and still tell something
const AREA = 128 * 128; // pixels of each
const SETTINGS = { max_samples: 32, resolution_scale: 1, denoise: true };
const PRIORITY = 1; // somebody looks on: it takes seconds, and goes before final pictures, which take minutes

const NUMBERS = ["slider", "number"];

// What a field of the material has, or undefined where neither it nor the schema says. `own` are its model's fields.
const valueOf = (own, material, name) => material[name] ?? own.find((field) => field.name === name)?.initial;

// The fields that can be swept: numbers with a range, of use with the choices made, and not in a texture's hands.
export const sweepable = (own, material) =>
  own.filter(
    ({ name, widget, soft, used }) =>
      NUMBERS.includes(widget) &&
      Number.isFinite(soft.max - soft.min) &&
      !isObject(material[name]) &&
      (!used || used.values.includes(valueOf(own, material, used.field))),
  );

// The value that a field has now, or undefined.
export const presentValue = (own, material, field) =>
  valueOf(own, material, field.name) ?? followed(field, valueOf(own, material, field.follows?.field));

// Values from end to end of the field's slider, rising; the present one is among them, in the place of its neighbour.
export function sweepValues(own, material, field) {
  const { open, ranges, soft, step } = field;
  const range = span(ranges ? endsOf(field, valueOf(own, material, ranges.field)) : soft, step, Boolean(ranges));
  const { min, max, isLog } = range;
  const valueAt = (share) =>
    isLog ? range.fromShare(share) : Number((Math.round((min + share * (max - min)) / step) * step).toPrecision(12));
  // A bound that does not belong to the range: the last value stands one step before it.
  const inside = (value) =>
    value <= open.min ? open.min + step : value >= open.max ? open.max - step : Math.min(Math.max(value, min), max);
  const even = [...new Set(Array.from({ length: COUNT }, (_, i) => inside(valueAt(i / (COUNT - 1)))))];
  const present = presentValue(own, material, field);
  if (typeof present !== "number" || even.includes(present)) return even;
  const distance = isLog
    ? (value) => Math.abs(range.toShare(value) - range.toShare(present))
    : (value) => Math.abs(value - present);
  const inner = even.slice(1, -1);
  const nearest = inner.reduce((best, each) => (distance(each) < distance(best) ? each : best), inner[0]);
  const isBetween = present > even[0] && present < even.at(-1);
  return [...even.filter((value) => !isBetween || value !== nearest), present].sort((a, b) => a - b);
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
