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
// null where it is in none.
export function wayOut(box, others, right) {
  const neighbour = others.find((other) => overlap(box, other));
  if (!neighbour) return null;
  const level = [right[0], 0, right[2]];
  const direction = length(level) > 1e-6 ? normalize(level) : [1, 0, 0];
  const gap = GAP * Math.max(...extents(box));
  let offset = [0, 0, 0];
  let hit = neighbour;
  for (let i = 0; hit && i < others.length; i += 1) {
    // each is left behind once
    offset = add(offset, scale(direction, Math.max(0, exit(shifted(box, offset), hit, direction)) + gap));
    hit = others.find((other) => overlap(shifted(box, offset), other));
  }
  return { offset: offset.map((x) => Number(x.toPrecision(4))), neighbour };
}

const lies = (box) => {
  const [wide, tall, deep] = extents(box);
  return tall <= Math.min(wide, deep) && isFlat(box);
};

// What things stand on, by the height of its surface: {low, high, top} of what lies flat, and of rooms around the eye.
export const floors = (boxes, eye) =>
  boxes.filter(Boolean).flatMap((box) => {
    if (holds(box, eye)) return [{ ...box, top: box.low[1] }];
    return lies(box) ? [{ ...box, top: box.high[1] }] : [];
  });

// The height of the ground under the middle of a box: the highest floor there that is not above `reach`, else the
// lowest foot of the bodies around. Null where there is neither.
function groundAt(box, { grounds, bodies, reach }) {
  const point = middle(box);
  const under = grounds.filter(
    ({ low, high, top }) => top <= reach && [0, 2].every((k) => low[k] <= point[k] && point[k] <= high[k]),
  );
  if (under.length) return Math.max(...under.map(({ top }) => top));
  return bodies.length ? Math.min(...bodies.map(({ low }) => low[1])) : null;
}

// Where the box of a new model comes to stand: {offset, neighbour}, on the ground and out of all bodies, to the right
// of the one that it was in. One that is `lost` comes to where the camera looks first.
export function standing(box, { grounds, bodies, target, right, lost = false }) {
  const start = middle(box);
  const reach = target[1];
  const set = (at) => {
    const ground = groundAt(at, { grounds, bodies, reach });
    return ground === null ? at : shifted(at, [0, ground - at.low[1], 0]);
  };
  const near = set(lost ? shifted(box, [target[0] - start[0], 0, target[2] - start[2]]) : box);
  const way = wayOut(near, bodies, right);
  const stood = way ? set(shifted(near, way.offset)) : near;
  const offset = subtract(stood.low, box.low).map((x) => Number(x.toPrecision(6)) + 0);
  return { offset, neighbour: way?.neighbour ?? null };
}

const LIKE = 10; // how many times larger or smaller than its neighbours a thing may be

// The power of ten by which a model without a unit is as large as what it comes to, whose radius is `usual`; 1 where
// it is already.
export function sized({ radius }, usual) {
  const ratio = usual / radius;
  if (!(ratio > 0) || !Number.isFinite(ratio) || (ratio <= LIKE && ratio >= 1 / LIKE)) return 1;
  return Number((10 ** Math.round(Math.log10(ratio))).toPrecision(1));
}

// The body that the camera looks at: the one whose middle is nearest to its target, or null.
export function lookedAt(bodies, target) {
  const far = (box) => length(subtract(middle(box), target));
  return bodies.reduce((best, box) => (best && far(best) <= far(box) ? best : box), null);
}
