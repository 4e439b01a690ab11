// A thing of the scene moved, turned or scaled as a whole: a shape or a light, by a linear map about a pivot.

import { isLight } from "./kinds.js";
import { place } from "./placement.js";
import { KINDS } from "./shapes.js";
import { moved } from "./moving.js";
import { parts } from "./transforms.js";
import { add, cross, dot, length, scale, subtract, tidy, turn } from "../lib/vector.js";

const WORLD = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
];

// Linear maps of vectors: a turn about a unit axis, a stretch along one, the same in all directions.
export const turning = (axis, degrees) => (v) => turn(v, axis, (degrees * Math.PI) / 180);
export const stretching = (axis, factor) => (v) => add(v, scale(axis, (factor - 1) * dot(v, axis)));
export const growing = (factor) => (v) => scale(v, factor);

// An angle in degrees as one from -180 to 180.
export const wrapped = (degrees) => Number((degrees - 360 * Math.round(degrees / 360)).toFixed(2)) + 0;

// By an offset in metres; what has no place stays as it is.
export function shifted(thing, offset) {
  if (!isLight(thing)) return moved(thing, offset);
  return thing.position ? { ...thing, position: tidy(add(thing.position, offset)) } : thing;
}

// The transform after a map about a pivot. Maps along the thing's own axes, and turns, leave no skew where none was.
function composed(transform, map, pivot) {
  const origin = place([0, 0, 0], transform);
  const columns = WORLD.map((axis) => map(subtract(place(axis, transform), origin)));
  const to = add(pivot, map(subtract(origin, pivot)));
  const matrix = [0, 1, 2].flatMap((row) => [...columns.map((column) => column[row]), to[row]]);
  return parts([...matrix, 0, 0, 0, 1]) ?? { matrix: [...tidy(matrix), 0, 0, 0, 1] };
}

const isDiagonal = (map) => WORLD.every((axis, k) => map(axis).every((x, i) => i === k || Math.abs(x) < 1e-12));

// The factor of a map that turns, and scales alike in all directions; else 0.
function similarity(map) {
  const [x, y, z] = WORLD.map(map);
  const factor = length(x);
  const isSquare = [dot(x, y), dot(y, z), dot(z, x)].every((slant) => Math.abs(slant) < 1e-9 * factor * factor);
  const isEven = [y, z].every((axis) => Math.abs(length(axis) - factor) < 1e-9 * factor);
  return isSquare && isEven && dot(cross(x, y), z) > 0 ? factor : 0;
}

// The thing after a map about a pivot. Numbers of its own change where they can say it; else its transform does.
export function mapped(thing, map, pivot) {
  const to = (point) => tidy(add(pivot, map(subtract(point, pivot))));
  if (isLight(thing)) {
    const { position, direction } = thing;
    return {
      ...thing,
      ...(position ? { position: to(position) } : {}),
      ...(direction ? { direction: tidy(map(direction)) } : {}),
    };
  }
  const factors = isDiagonal(map) ? WORLD.map((axis, k) => map(axis)[k]) : null;
  const own = thing.transform
    ? null
    : KINDS[thing.type].mapped?.(thing, { map, to, factor: similarity(map), factors });
  if (own) return own;
  return { ...thing, transform: composed(thing.transform, map, pivot) };
}

// The unit axes along which a thing can be stretched without a skew, each beside the world's axis that it is nearest to.
export function ownAxes(thing) {
  const { transform } = thing;
  const origin = place([0, 0, 0], transform);
  const turned = WORLD.map((axis) => subtract(place(axis, transform), origin));
  const axes = (transform ? null : KINDS[thing.type]?.axes?.(thing)) ?? turned;
  const left = axes.map((axis) => scale(axis, 1 / length(axis)));
  return WORLD.map((_, k) => {
    const at = left.reduce((best, axis, i) => (Math.abs(axis[k]) > Math.abs(left[best][k]) ? i : best), 0);
    const [axis] = left.splice(at, 1);
    return axis[k] < 0 ? scale(axis, -1) : axis;
  });
}
