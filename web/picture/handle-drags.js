// What a drag of a handle means in the scene. Places are {x, y}, 0..1 across the picture; a view is {camera, aspect,
// height}, the height in CSS pixels.

import { axes, eye, halfHeight, project, ray } from "../document/camera.js";
import { add, cross, dot, normalize, scale, subtract } from "../lib/vector.js";

export const WORLD = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
];
export const NAMES = ["X", "Y", "Z"];
export const RING_PX = 80; // how far from the pivot the handles are
const DOUBLE_PX = 120; // a drag of the middle that makes a thing twice as large
const EDGE_ON = 0.2; // the cosine between a ring's axis and the view below which its plane tells no angle
const LEAST = 0.01; // of its size that one drag makes of a thing

// What a CSS pixel at a point's depth covers, in metres.
export function metresPerPixel({ camera, height }, point) {
  const depth = dot(subtract(point, camera.position), axes(camera).forward);
  return (2 * halfHeight(camera, depth)) / height;
}

// Where the ray through a place meets the plane through a point, or null where it does not.
function onPlane({ camera, aspect }, point, normal, { x, y }) {
  const [from, direction] = [eye, ray].map((part) => part(camera, x, y, aspect));
  const far = dot(subtract(point, from), normal) / dot(direction, normal);
  return far > 0 && Number.isFinite(far) ? add(from, scale(direction, far)) : null;
}

// How far along an axis through a point the ray through a place passes nearest to it.
function along({ camera, aspect }, point, axis, { x, y }) {
  const [from, direction] = [eye, ray].map((part) => part(camera, x, y, aspect));
  const between = subtract(from, point);
  const slant = dot(axis, direction);
  return (dot(between, axis) - dot(between, direction) * slant) / (1 - slant * slant);
}

// A function from a place to the offset in metres; `handle` is an axis's name, the name of a plane's normal after
// "plane ", or "view".
export function moving(view, pivot, handle, from) {
  const axis = WORLD[NAMES.indexOf(handle)];
  const normal = handle === "view" ? axes(view.camera).forward : WORLD[NAMES.indexOf(handle.slice(-1))];
  const read = (place) => (axis ? scale(axis, along(view, pivot, axis, place)) : onPlane(view, pivot, normal, place));
  const start = read(from);
  let offset = [0, 0, 0];
  return (place) => {
    const now = read(place);
    if (start && now?.every(Number.isFinite)) offset = subtract(now, start); // else beyond the horizon
    return offset;
  };
}

// A function from a place to the angle in degrees about an axis, over any number of whole turns.
export function rotating(view, pivot, axis, from) {
  const eye = normalize(subtract(view.camera.position, pivot));
  const isSeen = Math.abs(dot(axis, eye)) > EDGE_ON;
  const across = normalize(cross(axis, isSeen ? WORLD.find((each) => Math.abs(dot(each, axis)) < 0.8) : eye));
  const other = cross(axis, across);
  const reach = RING_PX * metresPerPixel(view, pivot);
  const read = (place) => {
    const point = onPlane(view, pivot, isSeen ? axis : eye, place);
    if (!point) return null;
    const arm = subtract(point, pivot);
    return isSeen ? Math.atan2(dot(arm, other), dot(arm, across)) : dot(arm, across) / reach;
  };
  let before = read(from);
  let sum = 0;
  return (place) => {
    const now = read(place);
    if (now !== null && before !== null)
      sum += isSeen ? Math.atan2(Math.sin(now - before), Math.cos(now - before)) : now - before;
    before = now ?? before;
    return (sum * 180) / Math.PI;
  };
}

// A function from a place to the factor: along an axis by how far the hand is from the pivot, or of the whole by how far
// it went to the right and up.
export function scaling(view, pivot, axis, from) {
  const { camera, aspect, height } = view;
  const inPixels = ({ x, y }) => [x * aspect * height, y * height];
  if (!axis) {
    const [x0, y0] = inPixels(from);
    return (place) => {
      const [x, y] = inPixels(place);
      return 2 ** ((x - x0 - (y - y0)) / DOUBLE_PX);
    };
  }
  const middle = inPixels(project(camera, pivot, aspect));
  const end = inPixels(project(camera, add(pivot, scale(axis, RING_PX * metresPerPixel(view, pivot))), aspect));
  const way = normalize(subtract(end, middle));
  const far = (place) => dot(subtract(inPixels(place), middle), way);
  const start = far(from);
  return (place) => Math.max(LEAST, far(place) / start);
}
