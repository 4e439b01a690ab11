// The scene's materials as a whole: made, named, given to things, taken away. Each function takes a state of the
// editor and gives the members that change.

import { at, pointer } from "../lib/patch.js";

// A name that is not taken, from one that is wished for: "copper", "copper-2"; "Red paint", "Red paint 2".
export function fresh(wanted, taken) {
  const [, stem, number] = /^(.*?)(?:[- ](\d+))?$/s.exec(wanted);
  const gap = /^[a-z0-9_-]*$/.test(stem) ? "-" : " ";
  let name = wanted;
  for (let i = Number(number ?? 1) + 1; name in taken; i += 1) name = `${stem}${gap}${i}`;
  return name;
}

// The indices of the shapes that are made of a material.
export const users = ({ shapes }, name) => shapes.flatMap(({ material }, i) => (material === name ? [i] : []));

export const isShape = (thing) => thing.startsWith("/shapes/");

// Some things are made of another material of the scene.
export const wearing = (scene, things, name) => ({
  ...scene,
  shapes: scene.shapes.map((shape, i) =>
    things.includes(pointer("shapes", i)) ? { ...shape, material: name } : shape,
  ),
});

// What is selected with a material: the thing that is chosen if it is made of that or if nothing is, else the first that
// is; without any, the material itself.
export function selectedWith({ scene, chosen: { thing } }, name) {
  const [first] = users(scene, name);
  const worn = isShape(thing) ? at(scene, thing)?.material : undefined;
  if (worn === name || (worn !== undefined && first === undefined)) return thing;
  return first === undefined ? pointer("materials", name) : pointer("shapes", first);
}

// The selected thing gets the material, if it is a shape; else the material is selected alone.
export function added({ scene, chosen }, wanted, document) {
  const name = fresh(wanted, scene.materials);
  const whole = { ...scene, materials: { ...scene.materials, [name]: document } };
  const thing = isShape(chosen.thing) ? chosen.thing : pointer("materials", name);
  return { scene: wearing(whole, [thing], name), chosen: { ...chosen, material: name, thing } };
}

export const copied = (state, document) => added(state, state.chosen.material, document);

// What is wrong with a name for the material, or null.
export function problem({ materials }, from, to) {
  if (!to) return "A material needs a name.";
  if (to !== from && Object.hasOwn(materials, to)) return `There already is a material named ${to}.`;
  return to === "__proto__" ? "This name can't be used." : null; // JavaScript would lose it
}

// With another name and document for a material, at its place in the list; without a document it goes, and what was made
// of it is made of the one named `to`.
export function exchanged({ scene, chosen, compare }, from, to, document) {
  const materials = Object.entries(scene.materials).flatMap(([name, own]) =>
    name !== from ? [[name, own]] : document ? [[to, document]] : [],
  );
  const shapes = scene.shapes.map((shape) => (shape.material === from ? { ...shape, material: to } : shape));
  const alone = [from, to].map((name) => pointer("materials", name));
  const thing = chosen.thing === alone[0] ? alone[1] : chosen.thing;
  return {
    scene: { ...scene, materials: Object.fromEntries(materials), shapes },
    chosen: { ...chosen, thing, material: chosen.material === from ? to : chosen.material },
    compare: compare?.material === from ? { ...compare, material: to } : compare,
  };
}

export const renamed = (state, from, to) => exchanged(state, from, to, state.scene.materials[from]);

// Without a material: what was made of it is made of another one.
export function removed(state, name, instead) {
  const { scene, chosen } = exchanged(state, name, instead);
  const worn = isShape(chosen.thing) ? at(scene, chosen.thing).material : instead;
  const { compare } = state;
  return {
    scene,
    chosen: { ...chosen, material: worn, thing: selectedWith({ scene, chosen }, worn) },
    compare: compare?.material === name ? null : compare,
  };
}

// Whether others are made of the same material as a thing.
export function isShared({ scene }, thing) {
  return isShape(thing) && users(scene, at(scene, thing)?.material).length > 1;
}

// The material with a value that stands only beside that of `partner`, a field: both come, and go, together.
export function paired(material, name, value, partner) {
  const { [name]: old, [partner.name]: other = partner.example, ...rest } = material;
  return (value ?? null) === null ? rest : { ...rest, [name]: value, [partner.name]: other };
}

// Whether any thing is made of a material.
export const isWorn = ({ shapes }, name) => shapes.some(({ material }) => material === name);
