// A lamp as a photographer sets it: its colour and power, its size, its distance from what it shines at, and how soft it is.
// Nothing here changes its arguments.

import { NITS, emissionOf } from "./emission.js";
import { farther, positionOf, targetOf } from "./lamps.js";
import { isFlat, isLight } from "./kinds.js";
import { LIGHTS } from "./lights.js";
import { growing, mapped, stretching } from "./manipulation.js";
import { users } from "./materials.js";
import { place } from "./placement.js";
import { KINDS } from "./shapes.js";
import { linear } from "../lib/color.js";
import { at, put } from "../lib/patch.js";
import { length, normalize, scale, subtract } from "../lib/vector.js";

const LUMINANCE = [0.2126, 0.7152, 0.0722];
const FEWEST = 1e-4; // m: no lamp is smaller

const digits = (x) => Number(x.toPrecision(5));
const bright = (rgb) => rgb.reduce((sum, x, i) => sum + LUMINANCE[i] * x, 0);

// What holds its strength: the name of a light's own field.
export const strengthName = ({ type }) => LIGHTS[type]?.strength ?? "emission";

// Its strength as linear [r, g, b] in its unit.
export const lightOf = (scene, document) =>
  isLight(document) ? linear(document[strengthName(document)]) : emissionOf(scene.materials[document.material]);

// The material that shines with that; `rgb` as emissionOf has it.
function emitting(material, rgb) {
  if (material.emission_luminance === undefined) return { ...material, emission: rgb };
  const most = Math.max(...rgb);
  return {
    ...material,
    emission_luminance: Number((most * NITS).toPrecision(5)),
    ...(most > 0 ? { emission_color: rgb.map((x) => Number((x / most).toPrecision(5))) } : {}),
  };
}

// The scene with another strength of the lamp.
export function withLight(scene, thing, rgb) {
  const document = at(scene, thing);
  const tidied = rgb.map(digits);
  if (isLight(document)) return put(scene, `${thing}/${strengthName(document)}`, tidied);
  const { material } = document;
  return { ...scene, materials: { ...scene.materials, [material]: emitting(scene.materials[material], tidied) } };
}

// A strength in another colour, as bright as it was; `tint` is of any brightness, and what was black comes on at 1.
export function tinted(rgb, tint) {
  const own = bright(tint);
  return own > 0 ? tint.map((x) => (x * (bright(rgb) || 1)) / own) : rgb;
}

export const power = bright;

// Edges, or the axis and the radius, of a shape in the scene.
function spans(shape) {
  const origin = place([0, 0, 0], shape.transform);
  return KINDS[shape.type].lamp.spans(shape, (vector) => subtract(place(vector, shape.transform), origin));
}

// Its measures in metres: [{name, title, value}]; none of a point or a sun.
export function sizesOf(document) {
  if (isLight(document)) return [];
  const { u, v, axis, radius } = spans(document);
  const all = u
    ? [
        ["width", "Width", length(u)],
        ["height", "Height", length(v)],
      ]
    : [...(axis ? [["length", "Length", length(axis)]] : []), ["radius", "Radius", radius]];
  return all.map(([name, title, value]) => ({ name, title, value }));
}

// The area that is seen of it from the front, m², and the side of a square as large.
const areaOf = (document) => KINDS[document.type].lamp.facing(spans(document));

// The shape with another measure, about its middle.
function resized(document, name, value) {
  const before = sizesOf(document).find((each) => each.name === name).value;
  const factor = Math.max(value, FEWEST) / before;
  const own = spans(document);
  const center = positionOf(document);
  const { resized: anew } = KINDS[document.type].lamp;
  if (anew && !document.transform) return anew(document, name, factor, own, center);
  const along = { width: own.u, height: own.v, length: own.axis }[name];
  return mapped(document, along ? stretching(normalize(along), factor) : growing(factor), center);
}

// Whether other things shine with its material.
export const isShared = (scene, document) => !isLight(document) && users(scene, document.material).length > 1;

// The scene with a lamp of another shape, which gives what it shines at as much light as before.
function asBright(scene, thing, after) {
  const before = at(scene, thing);
  const changed = put(scene, thing, after);
  if (isShared(scene, before)) return changed;
  const rgb = lightOf(scene, before);
  return withLight(changed, thing, scale(rgb, areaOf(before) / areaOf(after)));
}

export const withSize = (scene, thing, name, value) => asBright(scene, thing, resized(at(scene, thing), name, value));

// What it shines at, and how far from that it is; null of a sun.
export function standing(scene, document, camera) {
  if (!positionOf(document)) return null;
  const target = targetOf(scene, document, camera);
  return { target, distance: length(subtract(positionOf(document), target)) };
}

export const withDistance = (scene, thing, { target, distance }, value) =>
  put(scene, thing, farther(at(scene, thing), target, value / distance));

// Its size over its distance.
export const softness = (document, { distance }) => Math.sqrt(areaOf(document)) / distance;

// The scene with the lamp grown or shrunk to another softness.
export function withSoftness(scene, thing, { distance }, value) {
  const document = at(scene, thing);
  const factor = (value * distance) / Math.sqrt(areaOf(document));
  return asBright(scene, thing, mapped(document, growing(factor), positionOf(document)));
}

export const softnessWords = (value) => (value < 0.15 ? "hard" : value < 0.5 ? "medium" : "soft");

// What its strength is for each unit that a lamp's box has: {unit: factor}, of a strength's luminance in its own unit.
export function photometry(scene, document) {
  if (isLight(document)) return scaled(LIGHTS[document.type].units(document));
  const { lamp } = KINDS[document.type];
  const sides = isFlat(document) && scene.materials[document.material].emission_sides === "both" ? 2 : 1;
  return scaled({ lm: Math.PI * lamp.surface(spans(document)) * sides, nt: 1 });
}

const scaled = (units) => Object.fromEntries(Object.entries(units).map(([unit, factor]) => [unit, NITS * factor]));

// The scene with another value of one of the lamp's own fields.
export const withField = (scene, thing, name, value) => put(scene, `${thing}/${name}`, value);
