// Lengths of the document, in metres, as an artist reads and writes them: 26 mm, 12.5 cm, 3 m.

import { parseNumber } from "./number.js";

// From so many metres on a length is told in this unit.
const UNITS = [
  { from: 1, unit: "m", metres: 1 },
  { from: 0.1, unit: "cm", metres: 0.01 },
  { from: 1e-5, unit: "mm", metres: 0.001 },
  { from: 0, unit: "µm", metres: 1e-6 },
];
const USUAL = UNITS[2]; // of nothing, and where nobody has said anything

const unitFor = (length) => (length ? UNITS.find(({ from }) => Math.abs(length) >= from * (1 - 1e-9)) : USUAL);

export const LENGTH_NEEDED = "A length is needed here, such as 26 mm, 2.5 cm or 1/8 in.";

// 0.026 -> "26 mm", in three digits that count.
export function lengthWords(length) {
  const { unit, metres } = unitFor(length);
  return `${Number((length / metres).toPrecision(3))} ${unit}`;
}

const LAST = /^([^a-zµ]*)([a-zµ]+)$/i; // a sum, and the one unit behind it

// The length in metres that a text says, or null. A number without a unit is in the one of the length that it replaces.
export function parseLength(text, before = null) {
  const plain = text.trim();
  const [, sum, unit] = LAST.exec(plain) ?? [];
  if (!unit && /[a-zµ]/i.test(plain)) return parseNumber(plain, "m"); // more than one, or e as in 1e-3
  const metres = unit ? parseNumber(`1 ${unit}`, "m") : unitFor(before).metres;
  const value = parseNumber(sum ?? plain, "1"); // no share of anything
  return value === null || metres === null ? null : Number((value * metres).toPrecision(12));
}
