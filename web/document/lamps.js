// Lights as a photographer places them: aimed at a subject, from a side where none is yet.

import { ownBox } from "./bounds.js";
import { axes } from "./camera.js";
import { isLamp } from "./emission.js";
import { isFlat, isLight } from "./kinds.js";
import { mapped, shifted } from "./manipulation.js";
import { place } from "./placement.js";
import { ballOf, middle, union } from "./placing.js";
import { KINDS } from "./shapes.js";
import { hit } from "./through.js";
import { add, cross, dot, length, normalize, scale, subtract, turn } from "../lib/vector.js";

// Where lamps stand about a subject, in degrees to the right of the camera and above the ground: a key light, a fill
// light, two that shine from behind, one from above.
const SIDES = [
  [-45, 45],
  [55, 25],
  [150, 40],
  [-150, 40],
  [0, 80],
];
const APART = 40; // degrees between two lamps as they are seen from the subject
const FAR = 3; // of the subject's radius to the lamp
const SIDE = 1.5; // of the subject's radius: a lamp's side, as large as makes soft shadows
const BEFORE = 0.85; // of the way to a wall that is in between

const radians = (degrees) => (degrees * Math.PI) / 180;
const rounded = (v) => v.map((x) => Number(x.toPrecision(4)) + 0);

// How far along a ray from a point a wall is met, or Infinity.
const wallAt = (shape, from, direction) =>
  (KINDS[shape.type].isWall ? hit(shape, from, direction) : null) ?? Infinity;

// What a new light is for: {center, radius, shapes}, the indices of its shapes: the selected thing, or where that is a lamp
// or none, all things that are neither flat nor lamps; at last what the camera looks at.
export function subjectOf(scene, thing, camera) {
  const isBody = (shape) => shape && !isFlat(shape) && !isLamp(scene, shape) && ownBox(shape);
  const chosen = /^\/shapes\//.test(thing) ? Number(thing.split("/")[2]) : -1;
  const shapes = isBody(scene.shapes[chosen])
    ? [chosen]
    : scene.shapes.flatMap((shape, i) => (isBody(shape) ? [i] : []));
  if (!shapes.length) return { center: camera.target, radius: axes(camera).distance / 4, shapes };
  return { ...ballOf(union(shapes.map((i) => ownBox(scene.shapes[i])))), shapes };
}

// The directions in which lights are seen from a point.
function directionsOf(scene, point) {
  const lamps = scene.shapes.filter((shape) => isLamp(scene, shape) && ownBox(shape));
  const places = [
    ...lamps.map((shape) => ballOf(ownBox(shape)).center),
    ...(scene.lights ?? []).filter(({ position }) => position).map(({ position }) => position),
  ];
  return places
    .map((each) => subtract(each, point))
    .filter((way) => length(way) > 0)
    .map(normalize);
}

// Where a new light stands: {position, toLight, distance}, on the first side of the subject that has none yet.
export function standOf(scene, camera, { center, radius }) {
  const { forward, right } = axes(camera);
  const level = [-forward[0], 0, -forward[2]];
  const back = length(level) > 1e-6 ? normalize(level) : cross(right, [0, 1, 0]);
  const taken = directionsOf(scene, center);
  const options = SIDES.map(([aside, above]) =>
    add(
      scale(
        add(scale(back, Math.cos(radians(aside))), scale(right, Math.sin(radians(aside)))),
        Math.cos(radians(above)),
      ),
      [0, Math.sin(radians(above)), 0],
    ),
  );
  const room = (way) => Math.min(...taken.map((each) => Math.acos(Math.min(1, dot(each, way)))), Math.PI);
  const free = options.find((way) => room(way) > radians(APART));
  const toLight = free ?? options.reduce((best, way) => (room(way) > room(best) ? way : best));
  const wall = Math.min(...scene.shapes.map((shape) => wallAt(shape, center, toLight)));
  const distance = Math.min(FAR * radius, BEFORE * wall);
  return { position: rounded(add(center, scale(toLight, distance))), toLight, distance };
}

// A shape that shines from there at the subject: {shape, area}, the area in m² that the subject sees.
export function lampShape(type, stand, { radius }, material) {
  const { make, facing } = KINDS[type].lamp;
  const shape = make(stand, SIDE * radius, material);
  return { shape, area: facing(shape) };
}

// All lights of a scene, sources without extent and shapes that emit: [{thing, document}].
export const lampsOf = (scene) => [
  ...(scene.lights ?? []).map((document, i) => ({ thing: `/lights/${i}`, document })),
  ...scene.shapes.flatMap((document, i) => (isLamp(scene, document) ? [{ thing: `/shapes/${i}`, document }] : [])),
];

// Where a light is, or null: of a sun, and where the document does not tell.
export function positionOf(document) {
  if (document.position || isLight(document)) return document.position ?? null;
  const own = ownBox(document);
  return own && middle(own);
}

// The unit direction in which a light that has one shines, or null.
function aimOf(document) {
  if (document.direction) return normalize(document.direction);
  if (!isFlat(document) || document.transform) return null;
  return normalize(KINDS[document.type].normal(document));
}

// What a light slides round: the body that it is aimed at, else the middle of all.
export function targetOf(scene, document, camera) {
  const [from, aim] = [positionOf(document), aimOf(document)];
  const bodies = scene.shapes
    .filter((shape) => !isFlat(shape) && !isLamp(scene, shape) && ownBox(shape))
    .map((shape) => ballOf(ownBox(shape)));
  const missed = ({ center, radius }) => {
    const way = subtract(center, from);
    const along = dot(way, aim);
    return along > 0 ? length(subtract(way, scale(aim, along))) / radius : Infinity;
  };
  const best = from && aim ? bodies.reduce((a, b) => (a && missed(a) <= missed(b) ? a : b), null) : null;
  return best && missed(best) < 1 ? best.center : subjectOf(scene, "", camera).center;
}

const POLE = radians(88); // above and below, where a light would turn on the spot

// The light turned about the vertical, and then up or down, so that `arm`, from the target to it, points along another one.
export function swung(document, target, arm, to) {
  const level = ([x, , z]) => (Math.hypot(x, z) > 1e-6 * length(to) ? [x, 0, z] : null);
  const [before, after] = [level(arm), level(to) ?? level(arm) ?? [0, 0, 1]];
  const heading = ([x, , z]) => Math.atan2(x, z);
  const yaw = before ? heading(after) - heading(before) : 0;
  const above = (v) => Math.asin(Math.min(1, Math.max(-1, v[1] / length(v))));
  const side = normalize(cross(after, [0, 1, 0]));
  const map = (v) => turn(turn(v, [0, 1, 0], yaw), side, above(to) - above(arm));
  // A ball that nothing was done to goes along as it is: no side of it is the front.
  if (KINDS[document.type]?.isBall && !document.transform) return shifted(document, subtract(map(arm), arm));
  return mapped(document, map, target);
}

// The light slid round a target by angles in radians, as the camera sees them: to the right and up.
export function slid(document, target, camera, right, up) {
  const { forward, right: aside } = axes(camera);
  const arm =
    isLight(document) && !document.position ? scale(document.direction, -1) : subtract(positionOf(document), target);
  const yaw = dot(arm, forward) > 0 ? -right : right; // what is behind the target goes the other way about
  const turned = turn(arm, [0, 1, 0], yaw);
  const level = cross(turned, [0, 1, 0]);
  const side = length(level) > 1e-6 * length(turned) ? normalize(level) : aside;
  const now = Math.asin(Math.min(1, Math.max(-1, turned[1] / length(turned))));
  const lift = Math.min(Math.max(now + up, -POLE), POLE) - now;
  return swung(document, target, arm, turn(turned, side, lift));
}

// The light at another distance from the target, as large as before.
export function farther(document, target, factor) {
  const from = positionOf(document);
  return from ? shifted(document, scale(subtract(from, target), factor - 1)) : document;
}

// A lamp's outline: {center, radius} of a ball, or {rings}, the polygons between which it lies; null where the document
// does not tell.
export function outlineOf(document) {
  if (isLight(document)) return null;
  const { isBall, rings } = KINDS[document.type];
  const own = ownBox(document);
  if (isBall) return own && { center: middle(own), radius: (own.high[0] - own.low[0]) / 2 };
  return rings
    ? { rings: rings(document).map((ring) => ring.map((point) => place(point, document.transform))) }
    : null;
}
