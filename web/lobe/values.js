// What all views share of the numbers: luminance, curves by channel, the places of values between nothing and the most.

import { niceCeiling } from "./plot.js";

// Decades that a logarithmic scale shows below its greatest value: enough for the diffuse part under a polished coat.
const FEWEST = 3;
const MOST = 8;
const FAINT = 0.25; // the share of the values that may lie below the scale's end

// Luminance of linear Rec.709.
export const luminance = ([r, g, b]) => 0.2126 * r + 0.7152 * g + 0.0722 * b;

export const CHANNELS = {
  luminance: [{ name: "y", title: "luminance", of: luminance }],
  rgb: [
    { name: "r", title: "red", of: ([r]) => r },
    { name: "g", title: "green", of: ([, g]) => g },
    { name: "b", title: "blue", of: ([, , b]) => b },
  ],
};

// The class of a channel's curve.
export const channelClass = (name) => (name === "y" ? "y" : `channel-${name}`);

export const isGrey = (colors) =>
  colors.every(([r, g, b]) => Math.abs(r - g) + Math.abs(g - b) <= 1e-4 * Math.max(r, g, b));

// {most, decades}: the scale that shows these values, decades 0 where it is linear. `most` is a round number; beyond it
// lies what is brighter than the share `bright` of the values.
export function scaleOf(values, isLog, bright = 1) {
  const lit = values.filter((value) => value > 0).sort((a, b) => a - b);
  const greatest = lit[Math.ceil(bright * lit.length) - 1] ?? 1;
  if (!isLog) return { most: niceCeiling(greatest), decades: 0 };
  const top = Math.ceil(Math.log10(greatest) - 1e-9);
  const faint = lit[Math.floor(FAINT * lit.length)] ?? greatest;
  return { most: 10 ** top, decades: Math.min(Math.max(top - Math.floor(Math.log10(faint)) + 1, FEWEST), MOST) };
}

// A value's share of the way from nothing to the scale's end, 0..1.
export function share(value, { most, decades }) {
  if (!(value > 0)) return 0;
  return decades ? Math.max(0, 1 + Math.log10(value / most) / decades) : value / most;
}

// The variants' curves: [{side, channel, title, class, values}].
export const curves = (data, channels, of) =>
  Object.entries(data).flatMap(([side, own]) =>
    CHANNELS[channels].map((channel) => ({
      side,
      channel: channel.name,
      class: `${side} ${channelClass(channel.name)}`,
      values: of(own).map(channel.of),
      title: [Object.keys(data).length > 1 ? side.toUpperCase() : "", channels === "rgb" ? channel.title : ""]
        .filter(Boolean)
        .join(", "),
    })),
  );

// The name of a column: "f_r", and with two variants "A_f_r".
export const column = (data, side, name) => (Object.keys(data).length > 1 ? `${side.toUpperCase()}_${name}` : name);

export const RGB = ["r", "g", "b"];

// Columns and rows for a table of colours over something: `of(own)` gives the colours of a variant.
export function colorTable(data, first, at, of, name) {
  const sides = Object.keys(data);
  return {
    columns: [first, ...sides.flatMap((side) => RGB.map((channel) => column(data, side, `${name}_${channel}`)))],
    rows: at.map((value, i) => [value, ...sides.flatMap((side) => of(data[side])[i])]),
  };
}
