// What lies along a ray through the picture, behind what is seen there: a click at the same place goes on to it.

import { meshBox } from "./bounds.js";
import { unplace } from "./placement.js";
import { KINDS } from "./shapes.js";
import { add, subtract } from "../lib/vector.js";

const SAME = 1e-4; // of a distance: what lies closer behind another thing touches it

// How far along a ray a shape is met, in lengths of `way`, or null.
export function hit(shape, from, way) {
  const origin = unplace(from, shape.transform);
  const there = subtract(unplace(add(from, way), shape.transform), origin);
  return KINDS[shape.type].hit(shape, origin, there, shape.asset || shape.vertices ? meshBox(shape) : null);
}

// The index of the shape that a further click takes, where `seen` is what the picture shows and `last` what the click
// before took: the next one along the ray, at last again the one that is seen. `passes(i)` is true of those that no
// click takes.
export function behind(shapes, from, way, seen, last, passes = () => false) {
  const own = hit(shapes[seen], from, way) ?? 0;
  const others = shapes
    .map((shape, i) => ({ i, t: i === seen || passes(i) ? null : hit(shape, from, way) }))
    .filter(({ t }) => t !== null && t >= own * (1 - SAME))
    .sort((a, b) => a.t - b.t);
  const order = [seen, ...others.map(({ i }) => i)];
  return order[(order.indexOf(last) + 1) % order.length];
}
