// Images on things without texture coordinates: they lie by box, once over the thing.

import { learn, ownExtent } from "./bounds.js";
import { retextured, rewired, texturesOf } from "./material-set.js";
import { fresh } from "./materials.js";
import { users } from "./textures.js";
import { things } from "./things.js";
import { inWords } from "../lib/format-text.js";
import { pointer } from "../lib/patch.js";
import { describeAsset } from "../server/api.js";

const isCharted = ({ type, mapping = "uv" }) => (type === undefined || type === "checker") && mapping === "uv";

// A texture that lies by box: with the extent of a thing, in metres, as often on it as on coordinates of 0 to 1.
function projected({ uv: _, ...texture }, extent) {
  const { scale = texture.type === "checker" ? [8, 8] : [1, 1] } = texture;
  const by = extent > 0 ? 1 / extent : 1;
  return { ...texture, mapping: "box", scale: scale.map((factor) => Number((factor * by).toPrecision(3))) };
}

// {scene, names}: the scene with the images and checkers of a material by box, and their names; null where it has none
// that lie by coordinates. What other materials show stays as it is: this one gets a copy.
export function byBox(scene, name, extent) {
  const material = scene.materials[name];
  const textures = { ...scene.textures };
  const shown = texturesOf(material, textures);
  const own = (texture) =>
    users(
      { materials: { [name]: material }, textures: Object.fromEntries(shown.map((each) => [each, textures[each]])) },
      texture,
    );
  const given = {}; // old names to new ones
  for (const each of shown) {
    const isMine = own(each) === users(scene, each);
    const texture = rewired(textures[each], given);
    if (!isCharted(texture) && texture === textures[each]) continue;
    given[each] = isMine ? each : fresh(each, textures);
    textures[given[each]] = isCharted(texture) ? projected(texture, extent) : texture;
  }
  const names = Object.values(given);
  if (!names.some((each) => textures[each].mapping === "box")) return null;
  return {
    scene: { ...scene, textures, materials: { ...scene.materials, [name]: retextured(material, given) } },
    names,
  };
}

// Has the images lie by box that `problem` says a thing has no coordinates for, and tells so; where there are none it
// is a refusal like any other.
export async function lieByBox({ acts, messages, problem, refuse }) {
  const indices = problem.errors.map(({ pointer: wrong }) => Number(wrong.split("/")[3]));
  await learn(
    indices.map((i) => acts.state.scene.shapes[i] ?? {}),
    describeAsset,
  );
  const { scene } = acts.state;
  let made = null;
  for (const i of indices) {
    const shape = scene.shapes[i];
    made = (shape && byBox(made?.scene ?? scene, shape.material, ownExtent(shape))) ?? made;
  }
  if (!made) return refuse();
  acts.amend({ scene: made.scene });
  const title = things(scene).find(({ thing }) => thing === pointer("shapes", indices[0]))?.title;
  messages.show("mapping", {
    title: `${made.names.map(inWords).join(", ")} ${made.names.length === 1 ? "lies" : "lie"} by box.`,
    detail: `${title} has no texture coordinates. Mapping and Scale are beside the image.`,
  });
  return null;
}
