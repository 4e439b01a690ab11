// Where a shape stands: a matrix as the move, turn and scale that a person edits, and shapes that are moved.

import { cross, dot, length, scale, tidy } from "../lib/vector.js";

// The cosine between two axes up to which they count as perpendicular: files hold single precision, and a part's
// matrix is the product of its parents'.
const SQUARE = 1e-4;

const degrees = (radians) => (radians * 180) / Math.PI;
const clean = (values) => tidy(values).map((x) => x + 0); // no -0

// The angles of Rz Ry Rx for a rotation's columns, in degrees. The turn about Z is taken away before the others are
// read off, so that they fit together also where the first axis points along Z and its angle is noise.
function angles([x, y, z]) {
  const about = Math.hypot(x[0], x[1]) < 1e-6 ? 0 : Math.atan2(x[1], x[0]);
  const [c, s] = [Math.cos(about), Math.sin(about)];
  const across = (axis) => c * axis[1] - s * axis[0];
  return [Math.atan2(-across(z), across(y)), Math.atan2(-x[2], c * x[0] + s * x[1]), about].map(degrees);
}

// {translate, rotate, scale} of a row-major matrix; null where it skews, for which there is no such form.
export function parts(matrix) {
  const [x, y, z] = [0, 1, 2].map((k) => [matrix[k], matrix[4 + k], matrix[8 + k]]);
  const factors = [x, y, z].map(length);
  const axes = [x, y, z].map((axis, k) => scale(axis, 1 / factors[k]));
  const slants = [dot(axes[0], axes[1]), dot(axes[1], axes[2]), dot(axes[2], axes[0])];
  if (slants.some((cosine) => !(Math.abs(cosine) < SQUARE))) return null;
  if (dot(cross(axes[0], axes[1]), axes[2]) < 0) {
    // A mirror image: along the axis whose turning back leaves the least rotation.
    const most = axes.map((axis, k) => -axis[k]).reduce((best, value, k, all) => (value > all[best] ? k : best), 0);
    axes[most] = scale(axes[most], -1);
    factors[most] *= -1;
  }
  return { translate: clean([matrix[3], matrix[7], matrix[11]]), rotate: clean(angles(axes)), scale: clean(factors) };
}

export const isSkewed = (transform) => Boolean(transform?.matrix && !parts(transform.matrix));

// A transform as its form shows it.
export function shown(transform = {}) {
  if (!transform.matrix) return transform;
  const { matrix } = transform;
  return parts(matrix) ?? { translate: [matrix[3], matrix[7], matrix[11]] };
}

export const translated = (matrix, [x, y, z]) => matrix.with(3, x).with(7, y).with(11, z);

// The transform with another move, turn or scale; undefined goes back to none.
export function changed(transform, name, value) {
  if (isSkewed(transform)) return { matrix: translated(transform.matrix, value ?? [0, 0, 0]) };
  const { [name]: _, ...rest } = shown(transform);
  return value === undefined ? rest : { ...rest, [name]: value };
}
