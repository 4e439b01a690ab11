// How lamps lie in the picture: their outlines, in pixels, and where the marks of those outside of it stand.

import { axes, isAround, project } from "../document/camera.js";
import { outlineOf } from "../document/lamps.js";
import { dot, mix, subtract } from "../lib/vector.js";
import { metresPerPixel } from "./handle-drags.js";

const NEAR = 1e-3; // of the distance to the target: what is nearer to the eye is cut off
const EDGE = 0.04; // of the picture: how far inside of it a mark stays

// The part of a polygon that is before the eye.
function before(camera, ring) {
  if (isAround(camera)) return ring;
  const { forward, distance } = axes(camera);
  const depth = (point) => dot(subtract(point, camera.position), forward) - NEAR * distance;
  return ring.flatMap((point, i) => {
    const next = ring[(i + 1) % ring.length];
    const [here, there] = [depth(point), depth(next)];
    const cut = here > 0 !== there > 0 ? [mix(point, next, here / (here - there))] : [];
    return here > 0 ? [point, ...cut] : cut;
  });
}

// The convex hull of points in a plane, all of them in the order of their angles [Andrew 1979].
export function hull(points) {
  const sorted = [...points].sort(([a, b], [x, y]) => a - x || b - y);
  const half = (all) => {
    const chain = [];
    for (const [x, y] of all) {
      for (;;) {
        const [b, a] = [chain.at(-1), chain.at(-2)];
        if (!a || (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) > 0) break;
        chain.pop();
      }
      chain.push([x, y]);
    }
    return chain.slice(0, -1);
  };
  return points.length < 3 ? points : [...half(sorted), ...half(sorted.reverse())];
}

const near = (x) => Number(x.toFixed(1));

// A lamp's outline as an SVG path in pixels of the picture; empty where it has none, or lies behind the eye.
export function outlinePath(document, view) {
  const { camera, aspect, height } = view;
  const outline = outlineOf(document);
  if (!outline) return "";
  const onto = (point) => {
    const { x, y } = project(camera, point, aspect);
    return [x * aspect * height, y * height];
  };
  if (outline.center) {
    const { z } = project(camera, outline.center, aspect);
    if (z <= outline.radius) return "";
    const r = near(outline.radius / metresPerPixel(view, outline.center));
    const [x, y] = onto(outline.center).map(near);
    return `M${x - r} ${y}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0Z`;
  }
  const points = hull(outline.rings.flatMap((ring) => before(camera, ring)).map(onto));
  return points.length < 2 ? "" : `M${points.map((point) => point.map(near).join(" ")).join("L")}Z`;
}

// Where in the picture a mark stands: {x, y} 0..1, and whether the point itself is in it; else `way` is the angle in which
// that lies, in radians from the right and clockwise, as the screen has it.
export function spot(camera, point, aspect) {
  const { x, y, z } = project(camera, point, aspect);
  if (z > 0 && x >= 0 && x <= 1 && y >= 0 && y <= 1) return { x, y, isInside: true };
  // From the middle towards it, as far as the edge; what is behind the eye appears mirrored.
  const way = z > 0 ? [x - 0.5, y - 0.5] : [0.5 - x, 0.5 - y];
  const reach = (0.5 - EDGE) / Math.max(Math.abs(way[0]), Math.abs(way[1]), 1e-9);
  return {
    x: 0.5 + way[0] * reach,
    y: 0.5 + way[1] * reach,
    isInside: false,
    way: Math.atan2(way[1], way[0] * aspect),
  };
}

const overlaps = ({ x, y }, size, { left, top, right, bottom }) =>
  x + size > left && x - size < right && y + size > top && y - size < bottom;

// A place in pixels, for a mark of a radius, clear of boxes {left, top, right, bottom} and inside of `room`: as near as can
// be along one of the picture's axes.
export function clearOf(place, size, boxes, room) {
  const isFree = (at) =>
    !boxes.some((each) => overlaps(at, size, each)) &&
    at.x >= room.left + size - 0.5 &&
    at.x <= room.right - size + 0.5 &&
    at.y >= room.top + size - 0.5 &&
    at.y <= room.bottom - size + 0.5;
  const start = {
    x: Math.min(Math.max(place.x, room.left + size), room.right - size),
    y: Math.min(Math.max(place.y, room.top + size), room.bottom - size),
  };
  const columns = [start.x, ...boxes.flatMap(({ left, right }) => [left - size, right + size])];
  const rows = [start.y, ...boxes.flatMap(({ top, bottom }) => [top - size, bottom + size])];
  const options = columns.flatMap((x) => rows.map((y) => ({ x, y }))).filter(isFree);
  const far = ({ x, y }) => Math.hypot(x - start.x, y - start.y);
  return options.reduce((best, each) => (best && far(best) <= far(each) ? best : each), null) ?? start;
}
