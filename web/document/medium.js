// What fills a body, or all space around: nothing, or a medium by one of two descriptions.

import { ball, box, together } from "./bounds.js";
import { linear } from "../lib/color.js";

// The fields of each description; the others belong to both.
export const WAYS = { look: ["albedo", "radius"], coefficients: ["absorption", "scattering"] };

export const wayOf = (medium) => (medium?.albedo === undefined ? medium && "coefficients" : "look");

const FARTHEST = 1000; // m: the radius of a channel in which nothing happens to light
const CLOUDY = [0.8, 0.8, 0.8];

const round = (value) => Number(value.toPrecision(3));

// The albedo of single scattering that counts when light which goes on counts as not scattered, and back.
const alike = (albedo, g) => (albedo * (1 - g)) / (1 - albedo * g);
const unlike = (albedo, g) => albedo / (1 - g + g * albedo);

// sqrt(1 - albedo of single scattering) of what shows a colour, where all directions are alike: the server's fraction
// (gpu/tables/half_space.py); a test compares them.
export const rootOf = (shown) => {
  const over = 1 + shown * (1.559855 + shown * 0.061367);
  return ((1 - shown) * over) / (1 + shown * (3.818356 + shown * 2.803097));
};

// The colour by its root, by halving.
const shownBy = (root) => {
  let [low, high] = [0, 1];
  for (let i = 0; i < 40; i++) {
    const middle = (low + high) / 2;
    if (rootOf(middle) > root) low = middle;
    else high = middle;
  }
  return low; // 0 for the root of black
};

function look({ absorption = 0, scattering = 0, g = 0, ...others }) {
  const [a, s] = [linear(absorption), linear(scattering)];
  const total = a.map((x, i) => x + s[i]);
  const roots = total.map((x, i) => Math.sqrt(1 - alike(x > 0 ? s[i] / x : 0, g)));
  return {
    ...others,
    g,
    albedo: roots.map((root) => round(shownBy(root))),
    radius: total.map((x) => (x > 0 ? round(1 / x) : FARTHEST)),
  };
}

function coefficients({ albedo, radius, g = 0, ...others }) {
  const shares = linear(albedo).map((shown) => unlike(1 - rootOf(shown) ** 2, g));
  const totals = linear(radius).map((r) => 1 / r);
  return {
    ...others,
    g,
    absorption: totals.map((x, i) => round(x * (1 - shares[i]))),
    scattering: totals.map((x, i) => round(x * shares[i])),
  };
}

// How far light goes at first: not far in a body, some way through the scene.
function reach(scene, shape) {
  const own = shape && box(shape);
  if (own) return Math.min(...own.high.map((x, i) => x - own.low[i])) / 4;
  return 2 * (together(scene.shapes.map(ball).filter(Boolean))?.radius ?? 1);
}

// The medium by that description, or undefined for none; `shape` is the one that it fills, or null.
export function turned(medium, way, scene, shape) {
  if (way === "none") return undefined;
  const from = medium ?? { albedo: CLOUDY, radius: Array(3).fill(round(reach(scene, shape))) };
  if (way === wayOf(from)) return from;
  return way === "look" ? look(from) : coefficients(from);
}
