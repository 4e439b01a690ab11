// Where rays meet what shapes are made of, in lengths of the ray's vector.

import { add, cross, dot, scale, subtract } from "../lib/vector.js";

export const corners = (low, high) =>
  Array.from({ length: 8 }, (_, i) => [0, 1, 2].map((k) => ((i >> k) & 1 ? high : low)[k]));

// The first of some distances that is ahead, or null.
export function first(distances) {
  const ahead = distances.filter((t) => t > 0 && Number.isFinite(t));
  return ahead.length ? Math.min(...ahead) : null;
}

// Where a ray enters a box, or where it leaves one that it begins in.
export function boxHit({ low, high }, from, way) {
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
export function roots(a, b, c) {
  const rest = b * b - a * c;
  return rest < 0 || a === 0 ? [] : [(b - Math.sqrt(rest)) / a, (b + Math.sqrt(rest)) / a];
}

// Where a ray meets a plane, if `has(point)` there.
export function planeHit(origin, normal, from, way, has) {
  const t = dot(subtract(origin, from), normal) / dot(way, normal);
  return t > 0 && Number.isFinite(t) && has(subtract(add(from, scale(way, t)), origin)) ? t : null;
}

// Where a ray meets one of some triangles.
export function trianglesHit(vertices, faces, from, way) {
  const hits = faces.map(([a, b, c]) => {
    const [e1, e2] = [subtract(vertices[b], vertices[a]), subtract(vertices[c], vertices[a])];
    const normal = cross(e1, e2);
    return planeHit(vertices[a], normal, from, way, (p) => {
      const [u, v] = [dot(cross(p, e2), normal), dot(cross(e1, p), normal)];
      return u >= 0 && v >= 0 && u + v <= dot(normal, normal);
    });
  });
  return first(hits.map((hit) => hit ?? -1));
}
