// What lies along a ray through the picture, behind what is seen there: a click at the same place goes on to it.

import { boxAround, meshBox, unplace } from "./bounds.js";
import { add, cross, dot, length, scale, subtract } from "../lib/vector.js";

const MOST_FACES = 20_000; // of a mesh that is tried triangle by triangle; a larger one counts as its box
const SAME = 1e-4; // of a distance: what lies closer behind another thing touches it

// The first of some distances that is ahead, or null.
function first(distances) {
  const ahead = distances.filter((t) => t > 0 && Number.isFinite(t));
  return ahead.length ? Math.min(...ahead) : null;
}

// Where a ray enters a box, or where it leaves one that it begins in.
function boxHit({ low, high }, from, way) {
  let [near, far] = [-Infinity, Infinity];
  for (const k of [0, 1, 2]) {
    if (way[k] === 0) {
      if (from[k] < low[k] || from[k] > high[k]) return null;
      continue;
    }
    const [a, b] = [(low[k] - from[k]) / way[k], (high[k] - from[k]) / way[k]];
    near = Math.max(near, Math.min(a, b));
    far = Math.min(far, Math.max(a, b));
  }
  return near <= far ? first([near, far]) : null;
}

// Both solutions of a t^2 - 2 b t + c = 0.
function roots(a, b, c) {
  const rest = b * b - a * c;
  return rest < 0 || a === 0 ? [] : [(b - Math.sqrt(rest)) / a, (b + Math.sqrt(rest)) / a];
}

function sphereHit({ center, radius }, from, way) {
  const f = subtract(from, center);
  return first(roots(dot(way, way), -dot(f, way), dot(f, f) - radius * radius));
}

// Where a ray meets a plane, if `has(point)` there.
function planeHit(origin, normal, from, way, has) {
  const t = dot(subtract(origin, from), normal) / dot(way, normal);
  return t > 0 && Number.isFinite(t) && has(subtract(add(from, scale(way, t)), origin)) ? t : null;
}

function quadHit({ origin, u, v }, from, way) {
  const normal = cross(u, v);
  const area = dot(normal, normal);
  const within = (share) => share >= 0 && share <= 1;
  return planeHit(
    origin,
    normal,
    from,
    way,
    (p) => within(dot(cross(p, v), normal) / area) && within(dot(cross(u, p), normal) / area),
  );
}

const diskHit = ({ center, normal, radius }, from, way) =>
  planeHit(center, normal, from, way, (p) => length(p) <= radius);

function cylinderHit({ base, axis, radius, caps = true }, from, way) {
  const along = dot(axis, axis);
  const across = (p) => subtract(p, scale(axis, dot(p, axis) / along));
  const f = subtract(from, base);
  const [f2, w2] = [across(f), across(way)];
  const side = roots(dot(w2, w2), -dot(f2, w2), dot(f2, f2) - radius * radius).filter((t) => {
    const height = dot(add(f, scale(way, t)), axis) / along;
    return height >= 0 && height <= 1;
  });
  const ends = caps ? [base, add(base, axis)] : [];
  return first([...side, ...ends.map((center) => diskHit({ center, normal: axis, radius }, from, way) ?? -1)]);
}

function meshHit(shape, from, way) {
  const { vertices, faces } = shape;
  const whole = vertices ? boxAround(vertices) : meshBox(shape);
  const t = whole && boxHit(whole, from, way);
  if (!vertices || faces.length > MOST_FACES || t === null) return t;
  const hits = faces.map(([a, b, c]) => {
    const [e1, e2] = [subtract(vertices[b], vertices[a]), subtract(vertices[c], vertices[a])];
    return planeHit(vertices[a], cross(e1, e2), from, way, (p) => {
      const normal = cross(e1, e2);
      const [u, v] = [dot(cross(p, e2), normal), dot(cross(e1, p), normal)];
      return u >= 0 && v >= 0 && u + v <= dot(normal, normal);
    });
  });
  return first(hits.map((hit) => hit ?? -1));
}

const HITS = { sphere: sphereHit, quad: quadHit, disk: diskHit, cylinder: cylinderHit, mesh: meshHit };

// How far along a ray a shape is met, in lengths of `way`, or null.
function hit(shape, from, way) {
  const origin = unplace(from, shape.transform);
  const there = subtract(unplace(add(from, way), shape.transform), origin);
  if (shape.type === "box") return boxHit({ low: shape.min, high: shape.max }, origin, there);
  return HITS[shape.type](shape, origin, there);
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
