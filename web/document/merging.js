// A scene that is added to another: its materials, textures and shapes under names that are free there.

import { fresh } from "./materials.js";
import { retextured, rewired } from "./material-set.js";

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

const mapped = (documents, change) =>
  Object.fromEntries(Object.entries(documents).map(([name, document]) => [name, change(document)]));

// {textures, materials, shapes} of `other` as `scene` can take them over. Lights, camera and environment stay behind.
export function adapted(other, scene) {
  const images = names(other.textures ?? {}, scene.textures ?? {});
  const given = names(other.materials, scene.materials);
  const materials = mapped(other.materials, (material) => retextured(material, images));
  return {
    textures: under(
      mapped(other.textures ?? {}, (texture) => rewired(texture, images)),
      images,
    ),
    materials: under(materials, given),
    shapes: other.shapes.map((shape) => ({ ...shape, material: given[shape.material] })),
  };
}
