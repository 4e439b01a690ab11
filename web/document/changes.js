// What differs between two scenes, in a person's words.

import { inWords } from "../lib/format-text.js";
import { equal, pointer } from "../lib/patch.js";
import { things } from "./things.js";

const PARTS = { camera: "the view", environment: "the environment" };

// The places of a list or a table in which two differ.
const differing = (before, after) =>
  [...new Set([before ?? {}, after ?? {}].flatMap(Object.keys))].filter((key) => !equal(before?.[key], after?.[key]));

// The name of the one thing or material that differs, or else of all that does: "Gold", "the view", "the change".
export function changed(before, after) {
  const parts = differing(before, after).filter((part) => part !== "textures");
  const own = (part) => differing(before?.[part], after[part]);
  // A thing that only wears another material is about that one.
  const worn = own("shapes").map((i) => [before?.shapes?.[i], after.shapes[i]]);
  const isWorn = worn.every(([was, is]) => was && is && equal({ ...was, material: is.material }, is));
  if (parts.length && parts.every((part) => ["materials", "shapes"].includes(part)) && isWorn) {
    const wearing = new Set(after.shapes.map(({ material }) => material));
    const names = [...own("materials"), ...worn.map(([, is]) => is.material)].filter((name) => wearing.has(name));
    const [name, ...others] = [...new Set(names)];
    if (name !== undefined && !others.length) return inWords(name);
  }
  if (parts.length === 1) {
    const [part] = parts;
    if (PARTS[part]) return PARTS[part];
    const keys = ["shapes", "lights"].includes(part) ? own(part) : [];
    const title = keys.length === 1 ? titled(after, part, keys[0]) : null;
    if (title) return title;
    if (part === "lights") return "the lights";
  }
  return "the change";
}

function titled(scene, part, key) {
  const thing = pointer(part, key);
  return things(scene).find((each) => each.thing === thing)?.title ?? null;
}
