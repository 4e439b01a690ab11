// Vectors as arrays of three numbers.

export const add = (a, b) => a.map((x, i) => x + b[i]);
export const subtract = (a, b) => a.map((x, i) => x - b[i]);
export const scale = (a, s) => a.map((x) => x * s);
export const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
export const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
export const length = (a) => Math.hypot(...a);
export const normalize = (a) => scale(a, 1 / length(a));
export const mix = (a, b, t) => a.map((x, i) => x + (b[i] - x) * t);

const DUST = 1e-9; // of the greatest: what sines and sums leave of a 0

// Seven digits: what float32 keeps, and what a document can be read with. The rest of a rounding is 0.
export const tidy = (a) => {
  const least = DUST * Math.max(...a.map(Math.abs));
  return a.map((x) => (Math.abs(x) < least ? 0 : Number(x.toPrecision(7))));
};

// v turned about the unit axis [Rodrigues].
export function turn(v, axis, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return add(add(scale(v, c), scale(cross(axis, v), s)), scale(axis, dot(axis, v) * (1 - c)));
}
