// Where new things stand: beside what is there, on the ground that it stands on. Boxes are {low, high}.

import { add, length, normalize, scale, subtract } from "../lib/vector.js";

const FLAT = 0.02; // of a box's greatest extent: what is thinner is a floor or a wall, which things may touch
const GAP = 0.1; // between neighbours, of the new thing's greatest extent

const extents = ({ low, high }) => subtract(high, low);
const shifted = ({ low, high }, offset) => ({ low: add(low, offset), high: add(high, offset) });
const overlap = (a, b) => [0, 1, 2].every((k) => a.low[k] < b.high[k] && b.low[k] < a.high[k]);
const holds = ({ low, high }, point) => point.every((x, k) => low[k] < x && x < high[k]);

const isFlat = (box) => Math.min(...extents(box)) < FLAT * Math.max(...extents(box));

// What is in the way of others: neither flat, nor a room in which the camera is.
export const solids = (boxes, eye) => boxes.filter((box) => box && !isFlat(box) && !holds(box, eye));

// The box around several, or null.
export function union(boxes) {
  if (!boxes.length) return null;
  const [low, high] = [
    [Math.min, "low"],
    [Math.max, "high"],
  ].map(([pick, end]) => boxes.map((box) => box[end]).reduce((a, b) => a.map((x, k) => pick(x, b[k]))));
  return { low, high };
}

export const middle = ({ low, high }) => scale(add(low, high), 0.5);
export const ballOf = (box) => ({ center: middle(box), radius: length(extents(box)) / 2 });

// How far along a direction a box has to go until it no longer overlaps another one.
function exit(box, other, direction) {
  const ways = direction.map((d, k) => (d > 0 ? (other.high[k] - box.low[k]) / d : (other.low[k] - box.high[k]) / d));
  return Math.min(...ways.filter((way, k) => Math.abs(direction[k]) > 1e-6));
}

// {offset, neighbour}: how far to move a box to the right to get it out of all `others`, and the one that it was in;
// null where it is in none. With `stands` it comes down, or up, to the ground that its neighbour stands on.
export function wayOut(box, others, right, { stands = false } = {}) {
  const neighbour = others.find((other) => overlap(box, other));
  if (!neighbour) return null;
  const level = [right[0], 0, right[2]];
  const direction = length(level) > 1e-6 ? normalize(level) : [1, 0, 0];
  const gap = GAP * Math.max(...extents(box));
  let offset = [0, stands ? neighbour.low[1] - box.low[1] : 0, 0];
  let hit = neighbour;
  for (let i = 0; hit && i < others.length; i += 1) {
    // each is left behind once
    offset = add(offset, scale(direction, Math.max(0, exit(shifted(box, offset), hit, direction)) + gap));
    hit = others.find((other) => overlap(shifted(box, offset), other));
  }
  return { offset: offset.map((x) => Number(x.toPrecision(4))), neighbour };
}
