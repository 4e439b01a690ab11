// The scene's textures as parameters of materials use them. A state of the editor goes in, another comes out.

import { fresh } from "./materials.js";
import { at, equal, isObject, put } from "../lib/patch.js";

// The places of two values in a parameter's range: a contrast that shows, and no ends of a range.
const LIGHT = 0.8;
const DARK = 0.2;

const reading = (state, place) => {
  const now = at(state, place);
  return isObject(now) ? now : {};
};

// With a texture of the scene at a parameter's place, read as the one before it was.
export const used = (state, place, name) => put(state, place, { ...reading(state, place), texture: name });

// With a texture that the scene may not have yet; `wanted` is the name that it gets, if that is free.
export function given(state, place, texture, wanted) {
  const textures = state.scene.textures ?? {};
  const same = Object.keys(textures).find((name) => equal(textures[name], texture));
  const name = same ?? fresh(wanted, textures);
  return used({ ...state, scene: { ...state.scene, textures: { ...textures, [name]: texture } } }, place, name);
}

// With an uploaded image, that lies as the image lay whose place it takes. A layer is one of that image.
export function pictured(state, place, asset, wanted) {
  const { type, layer, ...lying } = state.scene.textures?.[reading(state, place).texture] ?? {};
  return given(state, place, { ...(type ? {} : lying), asset }, wanted);
}

// With a texture that is computed, of two values that suit the parameter: a checker, a noise, or a ramp along u.
export function made(state, place, { soft }, type) {
  const low = Math.max(0, soft.min ?? 0);
  const high = Math.max(low, soft.max ?? 1);
  const [a, b] = [LIGHT, DARK].map((share) => Number((low + share * (high - low)).toPrecision(3)));
  const stops = [b, a].map((color, position) => ({ position, color }));
  return given(state, place, { type, ...(type === "ramp" ? { stops } : { a, b }) }, type);
}

// How many parameters of the scene's materials, and ramps, show a texture.
export const users = ({ materials, textures = {} }, name) =>
  [...Object.values(materials), ...Object.values(textures)]
    .flatMap(Object.values)
    .filter((value) => isObject(value) && value.texture === name).length;

// Whether all that was refused are textures on things that have no texture coordinates.
export const isUncharted = ({ errors = [] }) =>
  errors.length > 0 &&
  errors.every(
    ({ pointer, detail }) =>
      /^\/scene\/shapes\/\d+\/(asset|uvs|material)$/.test(pointer) && detail.includes("mapping 'box'"),
  );
