// Camera moves: each takes a camera {type, position, target, up, ...} and gives the members that change. This is the one
// place that knows how a camera makes a picture: KINDS has a row for each kind.

import { add, cross, dot, length, normalize, scale, subtract, tidy, turn } from "../lib/vector.js";

// At the poles the view would lose its up; two degrees keep it.
const POLE = (2 * Math.PI) / 180;

const radians = (degrees) => (degrees * Math.PI) / 180;

// The arm turned to the right and down about `up`, short of the poles.
function swing(arm, up, right, down) {
  const pole = normalize(up);
  const turned = turn(arm, pole, -right);
  const side = normalize(cross(pole, turned));
  const now = Math.acos(Math.min(Math.max(dot(pole, normalize(turned)), -1), 1));
  const wanted = Math.min(Math.max(now - down, POLE), Math.PI - POLE);
  return turn(turned, side, wanted - now);
}

// The eye circles the target; positive angles (radians) carry the picture's content right and down.
export const orbit = ({ position, target, up }, right, down) => ({
  position: tidy(add(target, swing(subtract(position, target), up, right, down))),
});

// The head turns: the target circles the eye, and the content moves with the hand.
export const look = ({ position, target, up }, right, down) => ({
  target: tidy(add(position, swing(subtract(target, position), up, -right, -down))),
});

// Unit vectors to the right, up and forward of the picture, and the distance to the target.
export function axes({ position, target, up }) {
  const view = subtract(target, position);
  const forward = normalize(view);
  const right = normalize(cross(forward, up));
  return { right, up: cross(right, forward), forward, distance: length(view) };
}

// A row for each kind of camera. `frame` has the unit vectors of `axes`:
//   halfHeight(camera, distance)  half the height of what the picture shows there, in metres; of a panorama, the arc
//   shown(height)       the members of one that shows that much of its target, besides its place
//   narrowed(camera, factor)  the members after a zoom, if that does not move the eye
//   fitted(height)      the members that have a ball of that height in the picture, if not its distance does that
//   project(camera, way, frame, aspect)  where what lies there from the eye is in the picture, as `project` says it
//   direction(camera, x, y, frame, aspect)  of any length, in which the ray goes through a place 0..1 to the right and down
//   offset(...)         likewise, from the eye to where that ray begins, if not there
//   isAround            it shows all directions, whatever its picture's shape is
const flat = {
  project(camera, way, { right, up, forward }, aspect) {
    const z = dot(way, forward);
    const tall = halfHeight(camera, z);
    return { x: (dot(way, right) / (tall * aspect) + 1) / 2, y: (1 - dot(way, up) / tall) / 2, z };
  },
};

// From the middle of a flat picture to a place in it, where it is as high as that.
const across = (tall, x, y, { right, up }, aspect) =>
  add(scale(right, (2 * x - 1) * tall * aspect), scale(up, (1 - 2 * y) * tall));

const KINDS = {
  perspective: {
    ...flat,
    halfHeight: ({ vfov }, distance) => distance * Math.tan(radians(vfov) / 2),
    direction: (camera, x, y, frame, aspect) =>
      add(frame.forward, across(halfHeight(camera, 1), x, y, frame, aspect)),
  },
  orthographic: {
    ...flat,
    halfHeight: ({ height }) => height / 2,
    shown: (height) => ({ height }),
    narrowed: ({ height }, factor) => ({ height: Number((height * factor).toPrecision(6)) }),
    fitted: (height) => ({ height: Number(height.toPrecision(4)) }),
    offset: (camera, x, y, frame, aspect) => across(halfHeight(camera, 1), x, y, frame, aspect),
    direction: (_camera, _x, _y, { forward }) => forward,
  },
  panorama: {
    isAround: true,
    halfHeight: (_, distance) => (distance * Math.PI) / 2,
    project(_, way, { right, up, forward }) {
      const [x, y, z] = [right, up, forward].map((axis) => dot(way, axis));
      return {
        x: 0.5 + Math.atan2(x, z) / (2 * Math.PI),
        y: Math.atan2(Math.hypot(x, z), y) / Math.PI,
        z: length(way),
      };
    },
    direction(_, x, y, { right, up, forward }) {
      const [azimuth, polar] = [2 * Math.PI * (x - 0.5), Math.PI * y];
      const level = add(scale(right, Math.sin(azimuth)), scale(forward, Math.cos(azimuth)));
      return add(scale(level, Math.sin(polar)), scale(up, Math.cos(polar)));
    },
  },
};
const kindOf = ({ type }) => KINDS[type] ?? KINDS.perspective;

export const isAround = (camera) => Boolean(kindOf(camera).isAround);

// Half the height of what the picture shows at a distance from the eye, in metres; of a panorama, the arc.
export const halfHeight = (camera, distance) => kindOf(camera).halfHeight(camera, distance);

// The camera as one of another type, which shows as much of what it looks at.
export function turned(camera, type) {
  const { position, target, up } = camera;
  const height = Number((2 * halfHeight(camera, axes(camera).distance)).toPrecision(3));
  return { type, position, target, up, ...KINDS[type].shown?.(height) };
}

// Eye and target slide; the plane through the target follows the hand. In heights of the picture.
export function pan(camera, right, down) {
  const { position, target } = camera;
  const frame = axes(camera);
  const height = 2 * halfHeight(camera, frame.distance);
  const shift = add(scale(frame.right, -right * height), scale(frame.up, down * height));
  return { position: tidy(add(position, shift)), target: tidy(add(target, shift)) };
}

// Eye and target move together, in distances to the target.
export function fly({ position, target, up }, right, rise, forward) {
  const frame = axes({ position, target, up });
  const step = add(add(scale(frame.right, right), scale(normalize(up), rise)), scale(frame.forward, forward));
  const shift = scale(step, frame.distance);
  return { position: tidy(add(position, shift)), target: tidy(add(target, shift)) };
}

// The eye comes nearer to the target (factor below 1) or goes away; of parallel rays fewer are taken, or more.
export const zoom = (camera, factor) =>
  kindOf(camera).narrowed?.(camera, factor) ?? {
    position: tidy(add(camera.target, scale(subtract(camera.position, camera.target), factor))),
  };

// From the same side, so far that a ball fills `share` of the picture's shorter side.
export function frame(camera, { center, radius }, aspect, share = 0.8) {
  const { position, target } = camera;
  const narrow = Math.min(1, aspect);
  const { fitted } = kindOf(camera);
  const half = Math.atan(halfHeight(camera, 1) * narrow);
  const distance = fitted
    ? Math.max(axes(camera).distance, 2 * radius)
    : radius / Math.sin(Math.max(half * share, 1e-3));
  const back = normalize(subtract(position, target));
  const height = (2 * radius) / (share * narrow);
  return { position: tidy(add(center, scale(back, distance))), target: tidy(center), ...fitted?.(height) };
}

// Where a point is in the picture: x to the right and y down, both 0..1 within it, and z, its depth (behind the eye
// below 0).
export const project = (camera, point, aspect) =>
  kindOf(camera).project(camera, subtract(point, camera.position), axes(camera), aspect);

// Whether a box is in the picture with all its corners.
export function isInSight(camera, aspect, { low, high }) {
  return Array.from({ length: 8 }, (_, i) => low.map((x, k) => ((i >> k) & 1 ? high[k] : x))).every((corner) => {
    const { x, y, z } = project(camera, corner, aspect);
    return z > 0 && x >= 0 && x <= 1 && y >= 0 && y <= 1;
  });
}

// Where the ray through a place in the picture begins: x to the right and y down, both 0..1.
export function eye(camera, x, y, aspect) {
  const { offset } = kindOf(camera);
  return offset ? add(camera.position, offset(camera, x, y, axes(camera), aspect)) : camera.position;
}

// The unit direction in which it goes.
export const ray = (camera, x, y, aspect) => normalize(kindOf(camera).direction(camera, x, y, axes(camera), aspect));
