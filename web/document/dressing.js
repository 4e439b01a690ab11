// Things are made of a material that comes from elsewhere, bare or with its textures. It has the name that is wished for,
// or a free one like it, and takes the place of a material that nothing else is made of; the same material again, as it
// came, is not there twice.

import { exchanged, fresh, users, wearing } from "./materials.js";
import { received, unpacked, withTextures } from "./material-set.js";
import { at, equal, pointer, put } from "../lib/patch.js";

// {scene, compare, material, arrival, lost}: the scene with it on some things, and its name there; `arrival` as
// `withdrawn` takes it and `lost` as `received` says it. `was`: the material that it is to replace, where no thing is
// named.
export function dressed(state, things, { document, wanted }, was = at(state.scene, things[0]).material) {
  const { scene, compare } = state;
  const isReplaced = users(scene, was).every((i) => things.includes(pointer("shapes", i)));
  const { material, textures, added, lost } = received(scene, unpacked(document)[0]);
  const isCompared = isReplaced && compare?.material === was; // its variant B goes with it, under its new name
  const known = added.length || isCompared ? undefined : alike(scene, wanted, material);
  if (known !== undefined) {
    const next = isReplaced && known !== was ? exchanged(state, was, known).scene : scene;
    return { scene: wearing(next, things, known), compare, material: known, arrival: null, lost };
  }
  const { [was]: before, ...others } = scene.materials;
  const given = fresh(wanted, isReplaced ? others : scene.materials);
  const textured = withTextures(scene, textures);
  const next = isReplaced
    ? exchanged({ ...state, scene: textured }, was, given, material)
    : { scene: put(textured, pointer("materials", given), material), compare };
  const place = pointer("scene", "materials", given);
  const arrival = { place, before: isReplaced ? before : undefined, material, added, name: given, was };
  return { scene: wearing(next.scene, things, given), compare: next.compare, material: given, arrival, lost };
}

// The name of a material of the scene that came under such a name, and is still what it was; undefined where none is.
const alike = ({ materials }, wanted, material) =>
  Object.keys(materials).find((name) => {
    const rest = name.startsWith(wanted) ? name.slice(wanted.length) : null;
    return rest !== null && /^([- ]\d+)?$/.test(rest) && equal(materials[name], material);
  });
