// The material whose lobe is drawn: the one in hand with numbers in the place of its textures, because a BSDF has no
// surface on which an image could lie.

import { linear } from "../lib/color.js";
import { isObject } from "../lib/patch.js";

const CHANNELS = { r: 0, g: 1, b: 2, a: 3 };

const isTextured = (value) => isObject(value) && value.texture !== undefined;

// What a field reads of its texture: "color", or a channel, "r", "g", "b" or "a".
const readOf = ({ channel = "r" }, { widget }) => (widget === "color" ? "color" : channel);

// The names of the textures whose values a material shows, each with what is read of it: [{texture, reads}].
export const texturesOf = (material, fields) =>
  fields
    .filter(({ name, widget }) => isTextured(material[name]) && widget !== "texture")
    .map((field) => ({ texture: material[field.name].texture, reads: readOf(material[field.name], field) }));

function constant({ channel = "r", factor = 1 }, { widget, min = -Infinity, max = Infinity }, mean) {
  const inside = (x) => Number(Math.min(Math.max(x, min), max).toPrecision(6));
  if (widget !== "color") return inside(mean[CHANNELS[channel]] * linear(factor)[0]);
  return linear(factor).map((x, i) => inside(x * mean[i]));
}

// {material, replaced}: the document without textures, and the titles of the fields that had one. `fields` are those
// of the model; `mean(texture, reads)` is a texture's mean [r, g, b, a], linear. A normal map has no mean: it goes.
export function plain(material, fields, mean) {
  const out = { ...material };
  const replaced = [];
  for (const field of fields) {
    const value = material[field.name];
    if (!isTextured(value)) continue;
    replaced.push(field.title);
    if (field.widget === "texture") delete out[field.name];
    else out[field.name] = constant(value, field, mean(value.texture, readOf(value, field)));
  }
  return { material: out, replaced };
}
