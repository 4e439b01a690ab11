// A material with the textures that it shows, as it is saved, copied and carried into other scenes: a bare material
// where it shows none, else {materials: {NAME: material}, textures: {NAME: texture}}.

import { exchanged, fresh } from "./materials.js";
import { equal, isObject, put } from "../lib/patch.js";

const shows = (value) => isObject(value) && typeof value.texture === "string";

// The texture that a ramp reads, or undefined.
const readBy = (texture) => texture?.input?.texture;

// The names of the textures that a material shows, among `textures`, those that ramps read before the ramps.
export const texturesOf = (material, textures = {}) => [
  ...new Set(
    Object.values(material)
      .filter(shows)
      .flatMap(({ texture }) => [readBy(textures[texture]), texture].filter((name) => name !== undefined)),
  ),
];

// A texture with other names, {old: new}, for what it reads.
export const rewired = (texture, names) =>
  Object.hasOwn(names, readBy(texture) ?? "")
    ? { ...texture, input: { ...texture.input, texture: names[readBy(texture)] } }
    : texture;

// The material with other names for its textures, {old: new}.
export const retextured = (material, names) =>
  Object.fromEntries(
    Object.entries(material).map(([key, value]) =>
      shows(value) && Object.hasOwn(names, value.texture)
        ? [key, { ...value, texture: names[value.texture] }]
        : [key, value],
    ),
  );

// A material of a scene, ready to be carried away under this name.
export function carried(name, material, { textures = {} }) {
  const shown = texturesOf(material, textures).filter((each) => Object.hasOwn(textures, each));
  if (!shown.length) return material;
  return {
    materials: { [name]: material },
    textures: Object.fromEntries(shown.map((each) => [each, textures[each]])),
  };
}

// What a document of that kind holds: [{name, material, textures}], `name` null where it is bare; [] for others.
export function unpacked(document) {
  if (typeof document?.type === "string") return [{ name: null, material: document, textures: {} }];
  if (!isObject(document?.materials) || document.shapes) return [];
  const { materials, textures = {} } = document;
  return Object.entries(materials).map(([name, material]) => ({ name, material, textures }));
}

// A carried material as a scene can take it: {material, textures, added, lost}. `textures` are the scene's with those
// that came (`added`), each under a name that was free; one that the scene has already is used again. `lost` names
// those that neither has: the parameters that showed them are left out.
export function received(scene, { material, textures: carriedOnes }) {
  const own = scene.textures ?? {};
  const all = { ...own };
  const names = {};
  const shown = texturesOf(material, carriedOnes);
  for (const name of shown.filter((each) => Object.hasOwn(carriedOnes, each))) {
    const texture = rewired(carriedOnes[name], names);
    const isHere = (each) => Object.hasOwn(own, each) && equal(own[each], texture);
    names[name] = [name, ...Object.keys(own)].find(isHere) ?? fresh(name, all);
    all[names[name]] = texture;
  }
  const lost = shown.filter((name) => !Object.hasOwn(names, name) && !Object.hasOwn(own, name));
  const whole = Object.entries(material).filter(([, value]) => !shows(value) || !lost.includes(value.texture));
  return {
    material: retextured(Object.fromEntries(whole), names),
    textures: all,
    added: Object.keys(all).filter((name) => !Object.hasOwn(own, name)),
    lost,
  };
}

// The scene with these textures, which it has no table for where there are none.
export const withTextures = (scene, textures) => (Object.keys(textures).length ? { ...scene, textures } : scene);

// A state without a material that had come to a place: {place, before, added} as it was put there, and {name, was} where
// it came under a name of its own.
export function withdrawn(state, { place, before, added, name, was }) {
  const back = name === undefined ? put(state, place, before) : { ...state, ...exchanged(state, name, was, before) };
  const { textures, ...scene } = back.scene;
  const left = Object.entries(textures ?? {}).filter(([each]) => !added.includes(each));
  return { ...back, scene: withTextures(scene, Object.fromEntries(left)) };
}

// What the picture of a material depends on; the same as `before` where nothing of it is another object.
export function pictured(material, { textures = {} }, before = []) {
  const now = [material, ...texturesOf(material, textures).map((name) => textures[name])];
  return now.length === before.length && now.every((each, i) => each === before[i]) ? before : now;
}

export const missingWords = (names) =>
  `${names.map((name) => `“${name}”`).join(", ")} could not be found: the material was saved without its textures. ` +
  "Those parameters have their defaults.";
