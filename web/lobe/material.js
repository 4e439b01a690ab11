// The material whose lobe is drawn: the one in hand with numbers in the place of its textures, because a BSDF has no
// surface on which an image could lie.

import { linear } from "../color.js";
import { isObject } from "../patch.js";

const CHANNELS = { r: 0, g: 1, b: 2, a: 3 };

export const isTextured = (value) => isObject(value) && value.texture !== undefined;

// The names of the textures that a material shows, each with whether a colour is read from it: [{texture, isColor}].
export const texturesOf = (material, fields) => fields
  .filter(({ name }) => isTextured(material[name]))
  .map(({ name, widget }) => ({ texture: material[name].texture, isColor: widget === "color" }));

function constant({ channel = "r", factor = 1 }, { widget, min = -Infinity, max = Infinity }, mean) {
  const inside = (x) => Number(Math.min(Math.max(x, min), max).toPrecision(6));
  if (widget !== "color") return inside(mean[CHANNELS[channel]] * linear(factor)[0]);
  return linear(factor).map((x, i) => inside(x * mean[i]));
}

// {material, replaced}: the document without textures, and the titles of the fields that had one. `fields` are those
// of the model; `mean(texture, isColor)` is a texture's mean [r, g, b, a], linear. A normal map has no mean: it goes.
export function plain(material, fields, mean) {
  const out = { ...material };
  const replaced = [];
  for (const field of fields) {
    const value = material[field.name];
    if (!isTextured(value)) continue;
    replaced.push(field.title);
    if (field.widget === "texture") delete out[field.name];
    else out[field.name] = constant(value, field, mean(value.texture, field.widget === "color"));
  }
  return { material: out, replaced };
}
