// A row for each kind of shape: its geometry, before its transform.
//   make(center, r, material)  a new one of about that radius
//   points(shape)       some whose box is its own; null: not known
//   touches(shape)      those where its box in the scene touches it, if that is not the box of its points
//   hit(shape, from, way)  how far along a ray it is met, or null
//   moved(shape, by)    with its places moved by a function
//   mapped(shape, by)   after a linear map, where its own numbers can say that, else null: `map` and `to` map vectors and
//                       places, `factor` is that of a map that turns and scales, else 0; `factors` those along the axes of
//                       one that does nothing but that, else null. Without it, or with null, the transform changes
//   axes(shape)         along which it can be stretched; the world's, if it has none
//   rings(shape)        the polygons between which it lies; of a ball (`isBall`) there are none
//   normal(shape)       of a flat one: where its front faces; lamps stay before one that `isWall`
//   lamp                of what can be a lamp: {make({position, toLight}, side, material), spans(shape, way),
//                       facing(spans), surface(spans), resized(shape, name, factor, spans, center)}: a new one that shines
//                       at the subject, as large as a square with that side; its edges or its axis and radius in the
//                       scene; the area that is seen from its front, and all of one side, m²; with another measure

import { place } from "./placement.js";
import { boxHit, corners, first, planeHit, roots, trianglesHit } from "./rays.js";
import { axesAbout, rimAbout, sevenDigits } from "./round.js";
import { add, cross, dot, length, normalize, scale, subtract, tidy } from "../lib/vector.js";

// Where a sphere's box touches it, also where its transform makes an ellipsoid of it.
function sphereTouches({ center, radius, transform }) {
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

const sphere = {
  make: (center, r, material) => ({ type: "sphere", center, radius: r, material }),
  isBall: true,
  touches: sphereTouches,
  points: ({ center, radius }) => sphereTouches({ center, radius }),
  hit({ center, radius }, from, way) {
    const f = subtract(from, center);
    return first(roots(dot(way, way), -dot(f, way), dot(f, f) - radius * radius));
  },
  moved: (shape, by) => ({ ...shape, center: by(shape.center) }),
  mapped: (shape, { to, factors }) =>
    factors?.every((factor) => factor === factors[0])
      ? { ...shape, center: to(shape.center), radius: sevenDigits(shape.radius * factors[0]) }
      : null,
  lamp: {
    make({ position }, side, material) {
      const radius = Number((side / 3).toPrecision(3));
      return { type: "sphere", center: position, radius, material };
    },
    spans: ({ radius }, way) => ({ radius: length(way([radius, 0, 0])) }),
    facing: ({ radius }) => Math.PI * radius * radius,
    surface: ({ radius }) => 4 * Math.PI * radius * radius,
  },
};

const box = {
  make: (center, r, material) => ({
    type: "box",
    min: center.map((x) => x - r),
    max: center.map((x) => x + r),
    material,
  }),
  points: ({ min, max }) => corners(min, max),
  hit: ({ min, max }, from, way) => boxHit({ low: min, high: max }, from, way),
  moved: (shape, by) => ({ ...shape, min: by(shape.min), max: by(shape.max) }),
  mapped: (shape, { to, factors }) => (factors ? { ...shape, min: to(shape.min), max: to(shape.max) } : null),
  rings: ({ min: [x0, y0, z0], max: [x1, y1, z1] }) =>
    [y0, y1].map((y) => [
      [x0, y, z0],
      [x1, y, z0],
      [x1, y, z1],
      [x0, y, z1],
    ]),
};

const quadCorners = ({ origin, u, v }) => [origin, add(origin, u), add(add(origin, u), v), add(origin, v)];

const quad = {
  make: (center, r, material) => ({
    type: "quad",
    origin: center.map((x, i) => x + [-r, 0, r][i]),
    u: [2 * r, 0, 0],
    v: [0, 0, -2 * r],
    material,
  }),
  isWall: true, // lamps stay before it
  normal: ({ u, v }) => cross(u, v),
  points: quadCorners,
  hit({ origin, u, v }, from, way) {
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
  },
  moved: (shape, by) => ({ ...shape, origin: by(shape.origin) }),
  mapped: (shape, { to, map }) => ({
    ...shape,
    origin: to(shape.origin),
    u: tidy(map(shape.u)),
    v: tidy(map(shape.v)),
  }),
  axes: ({ u, v }) => [u, v, cross(u, v)],
  rings: (shape) => [quadCorners(shape)],
  lamp: {
    make({ position, toLight }, side, material) {
      const flat = Math.abs(toLight[1]) > 0.999 ? [1, 0, 0] : normalize(cross([0, 1, 0], toLight));
      const u = scale(flat, side);
      const v = scale(cross(toLight, flat), side);
      const origin = subtract(position, scale(add(u, v), 0.5));
      // The normal, u x v, leads from the subject to the lamp: turned round, as it shines to the outside.
      return { type: "quad", origin: tidy(add(origin, u)), u: tidy(scale(u, -1)), v: tidy(v), material };
    },
    spans: ({ u, v }, way) => ({ u: way(u), v: way(v) }),
    facing: ({ u, v }) => length(u) * length(v),
    surface: ({ u, v }) => length(u) * length(v),
    resized(shape, name, factor, { u, v }, center) {
      const edges = { u: name === "width" ? scale(u, factor) : u, v: name === "height" ? scale(v, factor) : v };
      const origin = tidy(subtract(center, scale(add(edges.u, edges.v), 0.5)));
      return { ...shape, origin, u: tidy(edges.u), v: tidy(edges.v) };
    },
  },
};

const diskRim = ({ normal, center, radius }) => rimAbout(normal, center, radius);

const disk = {
  make: (center, r, material) => ({ type: "disk", center, normal: [0, 1, 0], radius: r, material }),
  normal: ({ normal }) => normal,
  points: diskRim,
  hit: ({ center, normal, radius }, from, way) => planeHit(center, normal, from, way, (p) => length(p) <= radius),
  moved: (shape, by) => ({ ...shape, center: by(shape.center) }),
  mapped(shape, { to, map, factor }) {
    if (!factor) return null;
    const normal = tidy(scale(map(shape.normal), 1 / factor));
    return { ...shape, center: to(shape.center), normal, radius: sevenDigits(shape.radius * factor) };
  },
  axes: ({ normal }) => axesAbout(normal),
  rings: (shape) => [diskRim(shape)],
  lamp: {
    make({ position, toLight }, side, material) {
      const radius = Number((side / Math.sqrt(Math.PI)).toPrecision(3)); // as large as the rectangle
      const normal = toLight.map((x) => Number((-x).toPrecision(4)) + 0);
      return { type: "disk", center: position, normal, radius, material };
    },
    spans: ({ normal, radius }, way) => ({ radius: length(way(scale(axesAbout(normal)[0], radius))) }),
    facing: ({ radius }) => Math.PI * radius * radius,
    surface: ({ radius }) => Math.PI * radius * radius,
  },
};

const cylinderRims = ({ base, axis, radius }) =>
  [base, add(base, axis)].map((center) => rimAbout(axis, center, radius));

const cylinder = {
  make: ([x, y, z], r, material) => ({
    type: "cylinder",
    base: [x, y - r, z],
    axis: [0, 2 * r, 0],
    radius: r,
    material,
  }),
  points: (shape) => cylinderRims(shape).flat(),
  hit({ base, axis, radius, caps = true }, from, way) {
    const along = dot(axis, axis);
    const across = (p) => subtract(p, scale(axis, dot(p, axis) / along));
    const f = subtract(from, base);
    const [f2, w2] = [across(f), across(way)];
    const side = roots(dot(w2, w2), -dot(f2, w2), dot(f2, f2) - radius * radius).filter((t) => {
      const height = dot(add(f, scale(way, t)), axis) / along;
      return height >= 0 && height <= 1;
    });
    const ends = caps ? [base, add(base, axis)] : [];
    const within = (p) => length(p) <= radius;
    return first([...side, ...ends.map((center) => planeHit(center, axis, from, way, within) ?? -1)]);
  },
  moved: (shape, by) => ({ ...shape, base: by(shape.base) }),
  mapped: (shape, { to, map, factor }) =>
    factor
      ? { ...shape, base: to(shape.base), axis: tidy(map(shape.axis)), radius: sevenDigits(shape.radius * factor) }
      : null,
  axes: ({ axis }) => axesAbout(axis),
  rings: cylinderRims,
  lamp: {
    // A tube that lies across the way to the subject: as long as two rectangles, and a sixteenth as thick.
    make({ position, toLight }, side, material) {
      const level = Math.abs(toLight[1]) > 0.999 ? [1, 0, 0] : normalize(cross([0, 1, 0], toLight));
      const radius = Number((side / 16).toPrecision(3));
      const axis = scale(level, 2 * side).map((x) => Number(x.toPrecision(4)) + 0);
      return { type: "cylinder", base: tidy(subtract(position, scale(axis, 0.5))), axis, radius, material };
    },
    spans: ({ axis, radius }, way) => ({ axis: way(axis), radius: length(way(scale(axesAbout(axis)[0], radius))) }),
    facing: ({ axis, radius }) => 2 * radius * length(axis),
    surface: ({ axis, radius }) => 2 * Math.PI * radius * length(axis),
    resized(shape, name, factor, { axis }, center) {
      if (name === "radius") return { ...shape, radius: Number((shape.radius * factor).toPrecision(5)) };
      const longer = scale(axis, factor);
      return { ...shape, base: tidy(subtract(center, scale(longer, 0.5))), axis: tidy(longer) };
    },
  },
};

// A mesh whose triangles the document has; what files hold is measured in bounds.js.

const MOST_FACES = 20_000; // of a mesh that is tried triangle by triangle; a larger one counts as its box

const mesh = {
  points: ({ vertices }) => vertices,
  // `whole` is its box, or null.
  hit({ vertices, faces }, from, way, whole) {
    const t = whole && boxHit(whole, from, way);
    return !vertices || faces.length > MOST_FACES || t === null ? t : trianglesHit(vertices, faces, from, way);
  },
};

export const KINDS = { sphere, box, quad, disk, cylinder, mesh };
