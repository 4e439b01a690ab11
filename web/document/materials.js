// The scene's materials as a whole: made, named, given to things, taken away. Each function takes a state of the
// editor and gives the members that change.

import { at, pointer } from "../lib/patch.js";

// A name that is not taken, from one that is wished for: "copper", "copper-2", "copper-3".
export function fresh(wanted, taken) {
  const [, stem, number] = /^(.*?)(?:-(\d+))?$/s.exec(wanted);
  let name = wanted;
  for (let i = Number(number ?? 1) + 1; name in taken; i += 1) name = `${stem}-${i}`;
  return name;
}

// The indices of the shapes that are made of a material.
export const users = ({ shapes }, name) => shapes.flatMap(({ material }, i) => (material === name ? [i] : []));

const isShape = (thing) => thing.startsWith("/shapes/");

// The selected thing gets the material, if it is a shape.
export function added({ scene, chosen }, wanted, document) {
  const name = fresh(wanted, scene.materials);
  const materials = { ...scene.materials, [name]: document };
  const shapes = scene.shapes.map((shape, i) =>
    chosen.thing === pointer("shapes", i) ? { ...shape, material: name } : shape,
  );
  return { scene: { ...scene, materials, shapes }, chosen: { ...chosen, material: name } };
}

export const copied = (state, document) => added(state, state.chosen.material, document);

// What is wrong with a name for the material, or null.
export function problem({ materials }, from, to) {
  if (!to) return "A material needs a name.";
  if (to !== from && Object.hasOwn(materials, to)) return `There is a material named ${to} already.`;
  return to === "__proto__" ? "This name can't be used." : null; // JavaScript would lose it
}

const dressed = (shapes, from, to) =>
  shapes.map((shape) => (shape.material === from ? { ...shape, material: to } : shape));

export function renamed({ scene, chosen, compare }, from, to) {
  const materials = Object.entries(scene.materials).map(([name, each]) => [name === from ? to : name, each]);
  return {
    scene: { ...scene, materials: Object.fromEntries(materials), shapes: dressed(scene.shapes, from, to) },
    chosen: { ...chosen, material: chosen.material === from ? to : chosen.material },
    compare: compare?.material === from ? { ...compare, material: to } : compare,
  };
}

// Without a material: what was made of it is made of another one.
export function removed({ scene, chosen, compare }, name, instead) {
  const { [name]: _, ...others } = scene.materials;
  return {
    scene: { ...scene, materials: others, shapes: dressed(scene.shapes, name, instead) },
    chosen: { ...chosen, material: instead },
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
