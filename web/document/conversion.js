// A material turned into another model: what both know stays, and so do the colour and the width of the highlight.

import { linear } from "../lib/color.js";
import { equal, isObject } from "../lib/patch.js";

const BASE_F0 = 0.04; // head-on reflectance of the dielectrics of `metal_rough`, and by default of the others
const ALPHA = { min: 0.001, max: 10 }; // of the distribution that `microfacet` begins with

const tidy = (x) => Number(Math.min(1, x).toPrecision(4));
const isPlain = ({ roughness, base_color, metallic }) =>
  roughness !== undefined && ![roughness, base_color, metallic].some(isObject);
const diffuse = ({ base_color = 0.5, metallic = 0 }) => linear(base_color).map((x) => tidy(x * (1 - metallic)));
const reflectance = ({ base_color = 0.5, metallic = 0 }) =>
  linear(base_color).map((x) => BASE_F0 * (1 - metallic) + x * metallic);

// Blinn and Phong's highlight for a roughness: its exponent 2 / alpha^2 - 2, alpha being roughness^2, and the
// reflectance at normal incidence times (exponent + 8) / 8, the normalisation that this model leaves out
// [Akenine-Moeller et al., Real-Time Rendering].
function blinnPhong(old) {
  const shininess = Number(Math.max(0, 2 / Math.max(old.roughness, 0.05) ** 4 - 2).toPrecision(3));
  return { shininess, specular: reflectance(old).map((x) => tidy((x * (shininess + 8)) / 8)), diffuse: diffuse(old) };
}

// About the mirrored direction angles are twice those of half vectors: a quarter of the exponent has the same width.
function phong(old) {
  const { shininess, ...colors } = blinnPhong(old);
  return { ...colors, shininess: Number((shininess / 4).toPrecision(3)) };
}

function microfacet(old) {
  const alpha = Math.min(Math.max(old.roughness ** 2, ALPHA.min), ALPHA.max);
  return { alpha: Number(alpha.toPrecision(4)), f0: reflectance(old).map(tidy), diffuse: diffuse(old) };
}

const HIGHLIGHTS = { blinn_phong: blinnPhong, phong, microfacet };

// The name of a model's colour. That of `microfacet` is the diffuse one, or where that is black the facets'.
function colorName({ type, fields }, material) {
  if (type !== "microfacet") return fields.find(({ widget }) => widget === "color")?.name;
  const { diffuse: own = 0, f0 } = material ?? {};
  return f0 !== undefined && !isObject(own) && Math.max(...linear(own)) === 0 ? "f0" : "diffuse";
}

// Whether a field of two models means the same. `specular` is an amount here and a colour there; `alpha` is the
// opacity, or a distribution's parameter whose range depends on that.
const means = (one, other) => one.widget === other?.widget && equal(one.ranges ?? null, other.ranges ?? null);

// `from` and `to` are {type, fields}, with the fields of schema.js.
export function converted(old, from, to) {
  const material = { type: to.type };
  for (const field of to.fields) {
    const value = old[field.name];
    const isTaken =
      value !== undefined &&
      means(
        field,
        from.fields.find(({ name }) => name === field.name),
      );
    if (isTaken && (field.takesTexture || !isObject(value))) material[field.name] = value;
  }
  const [color, own] = [colorName(from, old), colorName(to)];
  if (color && own && material[color] === undefined) {
    material[own] = old[color] ?? from.fields.find(({ name }) => name === color).initial;
  }
  if (isPlain(old)) Object.assign(material, HIGHLIGHTS[to.type]?.(old));
  // What a model asks for and no other has: the middle of its slider.
  for (const { name, required, widget, soft } of to.fields) {
    if (required && material[name] === undefined && widget !== "choice") material[name] = (soft.min + soft.max) / 2;
  }
  return material;
}
