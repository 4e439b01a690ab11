// Another distribution of `microfacet` with a peak as wide: each has a parameter of its own kind (a width, an exponent,
// an inverse width), and the number of one would be meaningless to the next.

import { isObject } from "../lib/patch.js";
import { endsOf } from "../lib/span.js";

// How fast D falls off at its peak, log D = log D(0) - slope theta^2, from alpha and gamma, and alpha from that.
const PEAKS = {
  phong: { slope: (n) => n / 2, alpha: (s) => 2 * s },
  beckmann: { slope: (a) => 1 / a ** 2 - 2, alpha: (s) => (s + 2) ** -0.5 },
  ggx: { slope: (a) => 2 / a ** 2 - 2, alpha: (s) => (s / 2 + 1) ** -0.5 },
  gtr: { slope: (a, g) => g / a ** 2 - g, alpha: (s, g) => (s / g + 1) ** -0.5 },
  abc: { slope: (a, g) => (a * g) / 2, alpha: (s, g) => (2 * s) / (g || 1) },
  sgd: {
    slope: (a, g) => 1 / a + g / a ** 2 - 2,
    alpha: (s, g) => (2 / (Math.sqrt(1 + 4 * g * (s + 2)) - 1)) * g || 1 / (s + 2),
  },
  gaussian: { slope: (a) => 1 / a ** 2, alpha: (s) => s ** -0.5 },
};
const FLATTEST = 1e-3; // a slope; below it, and above 0, all peaks are flat

const inside = (value, { min, max }) => Math.min(Math.max(value, min), max);

// The material with another distribution; `fields` are those of its model.
export function redistributed(material, to, fields) {
  const own = (name) => fields.find((field) => field.name === name);
  const known = (name) => material[name] ?? own(name).initial;
  const gamma = inside(known("gamma"), endsOf({ ...own("gamma"), soft: own("gamma") }, to));
  const next = { ...material, distribution: to };
  if (material.gamma !== undefined || gamma !== known("gamma")) next.gamma = gamma;
  const from = PEAKS[known("distribution")];
  if (!from || !PEAKS[to] || isObject(material.alpha)) return next;
  const slope = Math.max(from.slope(known("alpha"), known("gamma")), FLATTEST);
  next.alpha = Number(inside(PEAKS[to].alpha(slope, gamma), endsOf(own("alpha"), to)).toPrecision(3));
  return next;
}
