// The ball around a shape, as far as its document or what was uploaded here tells; other files of triangles are
// measured in the picture.

import { place, unplace } from "./placement.js";
import { KINDS } from "./shapes.js";
import { corners } from "./rays.js";
import { add, length, mix, scale, subtract } from "../lib/vector.js";

const measured = new Map(); // the corners of uploaded meshes, by asset

// `bounds`: least and greatest coordinates, as the server answers an upload.
export const measure = (asset, [low, high]) => measured.set(asset, corners(low, high));

const asked = new Map(); // the answers about meshes that were not uploaded here, by asset

// Has the boxes of these shapes' meshes known, as `describe(asset)` promises {bounds}; of some there are none.
export function learn(shapes, describe) {
  const files = shapes
    .map(({ asset }) => asset)
    .filter((asset) => asset && !measured.has(asset) && !asked.has(asset));
  for (const asset of new Set(files)) {
    const answer = describe(asset).then(
      ({ bounds }) => bounds && measure(asset, bounds),
      () => asked.delete(asset), // no connection: the next one who wants to know asks again
    );
    asked.set(asset, answer);
  }
  return Promise.all(shapes.map(({ asset }) => asked.get(asset)));
}

const seen = new Map(); // the corners of what was seen of other meshes, by asset

// Takes over which points of a mesh can be seen in the picture: all that is known of one that was not uploaded here.
export function see({ asset, transform }, cloud) {
  const { low, high } = boxAround(cloud.map((point) => unplace(point, transform)));
  seen.set(asset, corners(low, high));
}

// Points of a shape before its transform, or null where neither the document nor its file tells.
const points = (shape) =>
  KINDS[shape.type].points?.(shape) ?? measured.get(shape.asset) ?? seen.get(shape.asset) ?? null;

// {center, radius} of a cloud of points: around the middle of its box.
export function around(cloud) {
  const { low, high } = boxAround(cloud);
  const center = mix(low, high, 0.5);
  return { center, radius: cloud.reduce((most, p) => Math.max(most, length(subtract(p, center))), 0) };
}

function cloudOf(shape) {
  const { touches } = KINDS[shape.type];
  if (touches) return touches(shape);
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

// {low, high} of a mesh before its transform, or null.
export function meshBox({ asset, vertices }) {
  const cloud = vertices ?? measured.get(asset) ?? seen.get(asset);
  return cloud ? boxAround(cloud) : null;
}

// The longest side of a shape before its transform, in metres, or null where neither the document nor its file tells.
export function ownExtent(shape) {
  const cloud = points(shape);
  if (!cloud?.length) return null;
  const { low, high } = boxAround(cloud);
  return Math.max(...subtract(high, low));
}
