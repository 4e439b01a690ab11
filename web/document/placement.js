// Where a shape's transform takes places.

import { add, cross, dot, subtract } from "../lib/vector.js";

const radians = (degrees) => (degrees * Math.PI) / 180;

// A place after the shape's transform: T Rz Ry Rx S, or a matrix by rows.
export function place(point, transform) {
  if (!transform) return point;
  if (transform.matrix) {
    const m = transform.matrix;
    return [0, 4, 8].map((r) => m[r] * point[0] + m[r + 1] * point[1] + m[r + 2] * point[2] + m[r + 3]);
  }
  const { translate = [0, 0, 0], rotate = [0, 0, 0], scale: factor = 1 } = transform;
  const factors = typeof factor === "number" ? [factor, factor, factor] : factor;
  let [x, y, z] = point.map((value, i) => value * factors[i]);
  const [a, b, c] = rotate.map(radians);
  [y, z] = [y * Math.cos(a) - z * Math.sin(a), y * Math.sin(a) + z * Math.cos(a)];
  [x, z] = [x * Math.cos(b) + z * Math.sin(b), z * Math.cos(b) - x * Math.sin(b)];
  [x, y] = [x * Math.cos(c) - y * Math.sin(c), x * Math.sin(c) + y * Math.cos(c)];
  return add([x, y, z], translate);
}

// Where a place was before the shape's transform.
export function unplace(point, transform) {
  const origin = place([0, 0, 0], transform);
  const [x, y, z] = [0, 1, 2].map((k) =>
    subtract(
      place(
        origin.map((_, i) => Number(i === k)),
        transform,
      ),
      origin,
    ),
  );
  const way = subtract(point, origin);
  const volume = dot(x, cross(y, z));
  return [cross(y, z), cross(z, x), cross(x, y)].map((across) => dot(way, across) / volume);
}
