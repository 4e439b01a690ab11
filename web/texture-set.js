// Images whose names say what they are of, which make a material with its textures.

import { dressed } from "./document/dressing.js";
import { received, withTextures } from "./document/material-set.js";
import { fresh, selectedWith } from "./document/materials.js";
import { amount, inWords } from "./lib/format-text.js";
import { pointer } from "./lib/patch.js";

// The state with all of these materials: the first on the thing, the others, and without a thing all of them, on the
// shelf alone.
export function collected(state, thing, materials) {
  const [first, ...others] = materials;
  const onThing = thing && dressed(state, [thing], { document: alone(first), wanted: first.name });
  let { scene, compare } = onThing ?? state;
  let chosen = onThing?.material;
  for (const { name, ...set } of onThing ? others : materials) {
    const { material, textures } = received(scene, set);
    const free = fresh(name, scene.materials);
    scene = { ...withTextures(scene, textures), materials: { ...scene.materials, [free]: material } };
    chosen ??= free;
  }
  const selected = { ...state.chosen, ...(thing ? { thing } : {}), material: chosen };
  return { scene, compare, chosen: { ...selected, thing: selectedWith({ scene, chosen: selected }, chosen) } };
}

const alone = ({ name, material, textures }) => ({ materials: { [name]: material }, textures });

// "Moss: 3 images, AO left out": a set in one line.
export function heading(materials, warnings) {
  const name = materials.length === 1 ? materials[0].name : amount(materials.length, "material");
  const textures = materials.flatMap((each) => Object.values(each.material).map((value) => value?.texture));
  const images = new Set(textures.filter(Boolean)).size;
  const left = warnings.filter(({ detail }) => detail.includes("left out"));
  const others = left.filter(({ detail }) => !detail.startsWith("ambient occlusion"));
  const parts = [
    ...(others.length < left.length ? ["AO"] : []),
    ...(others.length ? [amount(others.length, "file")] : []),
  ];
  return `${name}: ${images ? amount(images, "image") : "no images"}${parts.length ? `, ${parts.join(" and ")} left out` : ""}`;
}

// What went where: a line for each parameter that shows an image.
export function placed({ name, material }, titles, isOne) {
  const shown = Object.entries(material).filter(([, value]) => value?.texture);
  const lines = shown.map(([key, { texture, channel }]) => {
    const from = channel ? `${texture} (${channel.toUpperCase()})` : texture;
    return `${titles[key] ?? inWords(key)}: ${from}`;
  });
  return isOne ? lines : lines.map((line) => `${name}, ${line}`);
}

// The thing that a set is for: what lies where it was dropped, else what is selected, also where the picture can't yet
// tell what lies there; null where that is the background.
export async function thingFor(at, { controller, state }) {
  const { thing } = state.chosen;
  const selected = thing?.startsWith("/shapes/") ? thing : null;
  if (!at) return selected;
  const shape = await controller.shapeAt(at.x, at.y).catch(() => undefined);
  if (shape === undefined) return selected;
  return shape === null ? null : pointer("shapes", shape);
}
