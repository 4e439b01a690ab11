// The ball around a shape, as far as its document or what was uploaded here tells; other files of triangles are
// measured in the picture.

import { add, cross, dot, length, mix, normalize, scale, subtract } from "../lib/vector.js";

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

const corners = (low, high) =>
  Array.from({ length: 8 }, (_, i) => [0, 1, 2].map((k) => ((i >> k) & 1 ? high : low)[k]));

const measured = new Map(); // the corners of uploaded meshes, by asset

// `bounds`: least and greatest coordinates, as the server answers an upload.
export const measure = (asset, [low, high]) => measured.set(asset, corners(low, high));

const asked = new Map(); // the answers about meshes that were not uploaded here, by asset

// Has the boxes of these shapes' meshes known, as `describe(asset)` promises {bounds}; of some there are none.
export function learn(shapes, describe) {
  const files = shapes.map(({ asset }) => asset).filter((asset) => asset && !measured.has(asset) && !asked.has(asset));
  for (const asset of new Set(files)) {
    const answer = describe(asset).then(
      ({ bounds }) => bounds && measure(asset, bounds),
      () => asked.delete(asset), // no connection: the next one who wants to know asks again
    );
    asked.set(asset, answer);
  }
  return Promise.all(shapes.map(({ asset }) => asked.get(asset)));
}

// Where a sphere's box touches it, also where its transform makes an ellipsoid of it.
function touches({ center, radius, transform }) {
  const origin = place([0, 0, 0], transform);
  const columns = [0, 1, 2].map((k) =>
    subtract(
      place(
        origin.map((_, i) => Number(i === k)),
        transform,
      ),
      origin,
    ),
  );
  const middle = place(center, transform);
  return [0, 1, 2].flatMap((k) => {
    const reach = radius * length(columns.map((column) => column[k]));
    return [-reach, reach].map((way) => middle.map((x, i) => x + (i === k ? way : 0)));
  });
}

const seen = new Map(); // the corners of what was seen of other meshes, by asset

// Takes over which points of a mesh can be seen in the picture: all that is known of one that was not uploaded here.
export function see({ asset, transform }, cloud) {
  const { low, high } = boxAround(cloud.map((point) => unplace(point, transform)));
  seen.set(asset, corners(low, high));
}

// What is flat by its kind: a floor, a wall, a panel.
export const isFlat = ({ type }) => type === "quad" || type === "disk";

const RIM = 32; // points on a rim, whose box is half a per cent too small at most

// The unit axes of a disk or a cylinder before its transform: two across its normal or its axis, and that.
export function roundAxes({ normal, axis }) {
  const n = normalize(normal ?? axis);
  const right = Math.hypot(n[0], n[2]) > 1e-6 ? normalize([n[2], 0, -n[0]]) : [1, 0, 0];
  return [right, cross(n, right), n];
}

// Points on the rim of a disk, or of a cylinder's base, before its transform.
function rimOf(shape) {
  const { center, base, radius } = shape;
  const [right, up] = roundAxes(shape);
  return Array.from({ length: RIM }, (_, i) => {
    const angle = (2 * Math.PI * i) / RIM;
    const way = add(scale(right, Math.cos(angle)), scale(up, Math.sin(angle)));
    return add(center ?? base, scale(way, radius));
  });
}

// The rims of a disk or a cylinder before its transform.
export function rimsOf(shape) {
  const rim = rimOf(shape);
  return shape.axis ? [rim, rim.map((point) => add(point, shape.axis))] : [rim];
}

function points(shape) {
  if (shape.type === "disk" || shape.type === "cylinder") return rimsOf(shape).flat();
  if (shape.type === "box") return corners(shape.min, shape.max);
  if (shape.type === "quad") {
    const { origin, u, v } = shape;
    return [origin, add(origin, u), add(origin, v), add(add(origin, u), v)];
  }
  return shape.vertices ?? measured.get(shape.asset) ?? seen.get(shape.asset) ?? null;
}

// {center, radius} of a cloud of points: around the middle of its box.
export function around(cloud) {
  const { low, high } = boxAround(cloud);
  const center = mix(low, high, 0.5);
  return { center, radius: cloud.reduce((most, p) => Math.max(most, length(subtract(p, center))), 0) };
}

function cloudOf(shape) {
  if (shape.type === "sphere") return touches(shape);
  const cloud = points(shape);
  return cloud?.length ? cloud.map((point) => place(point, shape.transform)) : null;
}

// {center, radius}, or null where the document doesn't tell.
export function ball(shape) {
  const cloud = cloudOf(shape);
  return cloud && around(cloud);
}

// {low, high} of points.
export function boxAround(cloud) {
  const [low, high] = [Math.min, Math.max].map((pick) => cloud.reduce((a, b) => a.map((x, i) => pick(x, b[i]))));
  return { low, high };
}

const models = new WeakMap(); // the box around the whole model that a shape came with, while it stands as it came

export const remember = (shapes, whole) => {
  for (const shape of shapes) models.set(shape, whole);
};

// {low, high} of this shape alone, or null where the document doesn't tell.
export function ownBox(shape) {
  const cloud = cloudOf(shape);
  return cloud && boxAround(cloud);
}

// {low, high}, or null where neither the document nor its file tells.
export const box = (shape) => ownBox(shape) ?? models.get(shape) ?? null;

// Of several balls, the box around them.
export function together(balls) {
  if (!balls.length) return null;
  const cloud = balls.flatMap(({ center, radius }) =>
    corners(subtract(center, scale([1, 1, 1], radius)), add(center, scale([1, 1, 1], radius))),
  );
  const { center } = around(cloud);
  return {
    center,
    radius: balls.reduce((most, each) => Math.max(most, length(subtract(each.center, center)) + each.radius), 0),
  };
}

// {low, high} of a file's mesh before its transform, or null.
export function meshBox({ asset }) {
  const cloud = measured.get(asset) ?? seen.get(asset);
  return cloud ? boxAround(cloud) : null;
}

// The longest side of a shape before its transform, in metres, or null where neither the document nor its file tells.
export function ownExtent(shape) {
  if (shape.type === "sphere") return 2 * shape.radius;
  const cloud = points(shape);
  if (!cloud?.length) return null;
  const { low, high } = boxAround(cloud);
  return Math.max(...subtract(high, low));
}
