// Colours of light as temperatures.

import { linear, parseColor } from "./color.js";
import { count } from "./format-text.js";

export const COLDEST = 1800; // K, the ends of a slider
export const HOTTEST = 12000;
export const OWN = "own colour";

// What photographers call them.
export const NAMED = [
  { name: "Candle", kelvin: 1850 },
  { name: "Tungsten", kelvin: 2700 },
  { name: "Tungsten", kelvin: 3200 },
  { name: "Daylight", kelvin: 5600 },
  { name: "Overcast", kelvin: 6500 },
  { name: "Overcast", kelvin: 7500 },
  { name: "Sky", kelvin: 10000 },
];

// How far from a black body's colour, in u and v of 1960, a light has a temperature still [ANSI C78.377].
const NEAR = 0.006;
const ENDS = [1000, 40000].map((kelvin) => 1e6 / kelvin); // in mired, in which equal steps look alike

function chromaticity([r, g, b]) {
  const [x, y, z] = [
    0.4124 * r + 0.3576 * g + 0.1805 * b,
    0.2126 * r + 0.7152 * g + 0.0722 * b,
    0.0193 * r + 0.1192 * g + 0.9505 * b,
  ];
  const sum = x + 15 * y + 3 * z;
  return [(4 * x) / sum, (6 * y) / sum];
}

// The temperature of the black body that looks most like a linear colour, in three digits; null where none does.
export function temperatureOf(rgb) {
  if (!(Math.max(...rgb) > 0)) return null;
  const [u, v] = chromaticity(rgb);
  const miss = (mired) => {
    const [own, other] = chromaticity(linear({ kelvin: 1e6 / mired }));
    return Math.hypot(own - u, other - v);
  };
  let [high, low] = ENDS;
  for (let i = 0; i < 60; i += 1) {
    const third = (high - low) / 3;
    if (miss(low + third) < miss(high - third)) high -= third;
    else low += third;
  }
  return miss(low) <= NEAR ? Number((1e6 / low).toPrecision(3)) : null;
}

// 2700 -> "2 700 K".
export const kelvinWords = (kelvin) => `${count(kelvin)} K`;

// A temperature, or the linear colour, that a text says: "2700", "2700 K", "#ffb46b"; null for others.
export function parseLight(text) {
  const plain = text.replaceAll(/(?<=\d)[\s\u202f,](?=\d{3})/g, "").trim();
  const kelvin = Number(/^(\d{1,5}) *K?$/i.exec(plain)?.[1]);
  if (Number.isNaN(kelvin)) return parseColor(text);
  return kelvin >= 1000 && kelvin <= 40000 ? kelvin : null;
}
