// A scene that is added to another: its materials, textures and shapes under names that are free there.

import { fresh } from "./materials.js";
import { retextured } from "./material-set.js";

// Old names to new ones, none of which is taken.
function names(documents, taken) {
  const all = { ...taken };
  return Object.fromEntries(
    Object.keys(documents).map((name) => {
      const free = fresh(name, all);
      all[free] = true;
      return [name, free];
    }),
  );
}

const under = (documents, given) =>
  Object.fromEntries(Object.entries(documents).map(([name, document]) => [given[name], document]));

// {textures, materials, shapes} of `other` as `scene` can take them over. Lights, camera and environment stay behind.
export function adapted(other, scene) {
  const images = names(other.textures ?? {}, scene.textures ?? {});
  const given = names(other.materials, scene.materials);
  const materials = Object.fromEntries(
    Object.entries(other.materials).map(([name, material]) => [name, retextured(material, images)]),
  );
  return {
    textures: under(other.textures ?? {}, images),
    materials: under(materials, given),
    shapes: other.shapes.map((shape) => ({ ...shape, material: given[shape.material] })),
  };
}
