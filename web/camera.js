// Camera moves: each takes a camera {position, target, up, vfov} and gives the members that change.

const add = (a, b) => a.map((x, i) => x + b[i]);
const subtract = (a, b) => a.map((x, i) => x - b[i]);
const scale = (a, s) => a.map((x) => x * s);
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
const normalize = (a) => scale(a, 1 / Math.hypot(...a));
const tidy = (a) => a.map((x) => Number(x.toPrecision(7)));

// At the poles the view would lose its up; two degrees keep it.
const POLE = (2 * Math.PI) / 180;

// v turned about the unit axis [Rodrigues].
function turn(v, axis, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return add(add(scale(v, c), scale(cross(axis, v), s)), scale(axis, dot(axis, v) * (1 - c)));
}

// The eye circles the target; positive angles (radians) carry the picture's content right and down.
export function orbit({ position, target, up }, right, down) {
  const pole = normalize(up);
  const arm = turn(subtract(position, target), pole, -right);
  const side = normalize(cross(pole, arm));
  const now = Math.acos(Math.min(Math.max(dot(pole, normalize(arm)), -1), 1));
  const wanted = Math.min(Math.max(now - down, POLE), Math.PI - POLE);
  return { position: tidy(add(target, turn(arm, side, wanted - now))) };
}

// Eye and target slide; the plane through the target follows the hand. In heights of the picture.
export function pan({ position, target, up, vfov }, right, down) {
  const view = subtract(target, position);
  const height = 2 * Math.hypot(...view) * Math.tan((vfov * Math.PI) / 360);
  const x = normalize(cross(view, up));
  const y = normalize(cross(x, view));
  const shift = add(scale(x, -right * height), scale(y, down * height));
  return { position: tidy(add(position, shift)), target: tidy(add(target, shift)) };
}

// The eye comes nearer to the target (factor below 1) or goes away.
export const zoom = ({ position, target }, factor) => ({
  position: tidy(add(target, scale(subtract(position, target), factor))),
});
