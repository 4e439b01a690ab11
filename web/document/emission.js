// What emits light, and how much.

import { SHAPES } from "./kinds.js";
import { linear } from "../lib/color.js";
import { at, isObject } from "../lib/patch.js";

export const NITS = 683; // lm/W: a luminance over the radiance that it stands for

// What a material shines with, W/(m² sr) as linear [r, g, b]; black where a texture says it.
export function emissionOf(material) {
  const { emission, emission_luminance: luminance, emission_color: color = 1 } = material ?? {};
  const dark = [0, 0, 0];
  if (luminance !== undefined)
    return color.texture === undefined ? linear(color).map((x) => (x * luminance) / NITS) : dark;
  return emission === undefined || (isObject(emission) && emission.texture !== undefined) ? dark : linear(emission);
}

// Whether a shape of the scene emits light.
export const isLamp = ({ materials }, { material }) => Math.max(...emissionOf(materials[material])) > 0;

// Whether a thing is set as a lamp is: a light, or a shape as lamps are that emits.
export function isSet(scene, thing) {
  if (thing.startsWith("/lights/")) return true;
  const shape = thing.startsWith("/shapes/") ? at(scene, thing) : null;
  return Boolean(shape) && Boolean(SHAPES[shape.type]?.lamp) && isLamp(scene, shape);
}
