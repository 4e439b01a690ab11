// A thing is made of another material: one of the scene ({name}), or one that comes from elsewhere ({document, wanted}),
// bare or with its textures. A thing that has its material for itself keeps that one's name; one that shares it gets one
// of its own, named as is wished for.

import { fresh, isShared } from "./materials.js";
import { received, unpacked, withTextures } from "./material-set.js";
import { at, pointer, put } from "../lib/patch.js";

// {scene, material, arrival, lost}: the scene with it, and its name there; `arrival` as `withdrawn` takes it and `lost`
// as `received` says it of what comes from elsewhere.
export function dressed(state, thing, { name, document, wanted }) {
  const { scene } = state;
  if (document === undefined)
    return { scene: put(scene, `${thing}/material`, name), material: name, arrival: null, lost: [] };
  const was = at(scene, thing).material;
  const { material, textures, added, lost } = received(scene, unpacked(document)[0]);
  const given = isShared(state, thing) ? fresh(wanted, scene.materials) : was;
  const place = pointer("materials", given);
  const made = put(put(withTextures(scene, textures), place, material), `${thing}/material`, given);
  const arrival = { place: `/scene${place}`, before: at(scene, place), material, added, thing, was };
  return { scene: made, material: given, arrival, lost };
}
