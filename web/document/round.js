// What round shapes have in common.

import { add, cross, normalize, scale } from "../lib/vector.js";

const RIM = 32; // points on a rim, whose box is half a per cent too small at most

export const sevenDigits = (x) => Number(x.toPrecision(7));

// Unit axes of what is round about a vector: two across it, and its own.
export function axesAbout(vector) {
  const n = normalize(vector);
  const right = Math.hypot(n[0], n[2]) > 1e-6 ? normalize([n[2], 0, -n[0]]) : [1, 0, 0];
  return [right, cross(n, right), n];
}

// Points on a rim about a vector.
export function rimAbout(vector, center, radius) {
  const [right, up] = axesAbout(vector);
  return Array.from({ length: RIM }, (_, i) => {
    const angle = (2 * Math.PI * i) / RIM;
    const way = add(scale(right, Math.cos(angle)), scale(up, Math.sin(angle)));
    return add(center, scale(way, radius));
  });
}
