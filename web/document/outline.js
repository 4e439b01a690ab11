// The outline of a scene: a tree by the names of things, which are paths; and what is done to several things at once.
// `chosen.hidden` and `chosen.locked` are lists of things. Functions give the members of the state that change.

import { at, pointer, put } from "../lib/patch.js";
import { things } from "./things.js";

const unseen = (name) => `${name} (hidden)`; // the material of what is hidden

const pathOf = ({ name = "" }) => name.split("/").filter(Boolean);

// Rows of the tree, parents first: [{id, level, title, icon, note, thing, group, members}]. A group has no thing, and
// its members are all things in it; a thing is its own only member.
export function rows(scene) {
  const made = [];
  const groups = new Map(); // by path: the group's row
  for (const each of things(scene)) {
    const [, kind, index] = each.thing.split("/");
    const path = pathOf(scene[kind]?.[index] ?? {}).slice(0, -1);
    const above = path.map((_, i) => path.slice(0, i + 1).join("/"));
    above.forEach((group, i) => {
      if (groups.has(group)) return;
      const row = { id: `group ${group}`, level: i + 1, title: path[i], icon: "group", note: "", group, members: [] };
      groups.set(group, row);
      insert(made, row, above[i - 1]);
    });
    for (const group of above) groups.get(group).members.push(each.thing);
    const row = { ...each, id: each.thing, level: path.length + 1, group: null, members: [each.thing] };
    insert(made, row, above.at(-1));
  }
  return made;
}

const STAYS = {
  camera: "A scene keeps its camera.",
  environment: "The environment stays; the shelf has “None” among its environments.",
  materials: "The shelf has the button that deletes a material.",
};

// Said of a thing that somebody wanted to delete, and that stays.
export const whyItStays = (thing) => STAYS[thing.split("/")[1]] ?? "A scene keeps at least one thing.";

// Puts a row after all that stand in its group.
function insert(made, row, group) {
  if (group === undefined) return made.push(row);
  let at = made.findIndex((each) => each.group === group) + 1;
  while (at < made.length && made[at].level >= row.level) at += 1;
  return made.splice(at, 0, row);
}

// With another name for a thing or a group; an empty one takes a thing's name away.
export function named(state, row, title) {
  const clean = title.split("/").filter(Boolean).join("-").slice(0, 80);
  let next = state;
  for (const thing of row.members) {
    const [, kind, index] = thing.split("/");
    const path = pathOf(state.scene[kind][index]);
    const at = row.group === null ? Math.max(0, path.length - 1) : row.level - 1;
    path.splice(at, 1, ...(clean ? [clean] : []));
    next = put(next, `/scene${thing}/name`, path.length ? path.join("/") : undefined);
  }
  return { scene: next.scene };
}

// Whether a thing can have a name: it is one of a list.
export const isNameable = ({ group, thing }) => group !== null || /^\/(shapes|lights)\//.test(thing);

// The things on a list without those that are gone: the others move up.
function moved(list, gone) {
  return list
    .filter((thing) => !gone.includes(thing))
    .map((thing) => {
      const [, kind, index] = thing.split("/");
      const before = gone.filter((each) => each.split("/")[1] === kind && Number(each.split("/")[2]) < Number(index));
      return index === undefined ? thing : pointer(kind, Number(index) - before.length);
    });
}

// Without some things: lights and shapes, of which a scene keeps one.
export function without({ scene, chosen }, gone) {
  const left = (kind) => (scene[kind] ?? []).filter((_, i) => !gone.includes(pointer(kind, i)));
  const [, kind, index] = gone.at(-1).split("/");
  const [shapes, lights] = [left("shapes"), left("lights")];
  const rest = { shapes, lights }[kind];
  const before = gone.filter((each) => each.startsWith(`/${kind}/`) && Number(each.split("/")[2]) < Number(index));
  const next = rest.length ? pointer(kind, Math.min(Number(index) - before.length, rest.length - 1)) : "/camera";
  const { hidden = [], locked = [] } = chosen;
  const material = at({ shapes }, next)?.material ?? chosen.material; // the inspector goes on with what is selected
  return {
    scene: { ...scene, shapes, ...(scene.lights ? { lights } : {}) },
    chosen: { ...chosen, thing: next, material, hidden: moved(hidden, gone), locked: moved(locked, gone) },
  };
}

// All of some things are put on the list "hidden" or "locked" or, where all are on it, taken off.
export function toggled({ chosen }, list, some) {
  const now = chosen[list] ?? [];
  const isOn = some.every((thing) => now.includes(thing));
  const rest = now.filter((thing) => !some.includes(thing));
  return { chosen: { ...chosen, [list]: isOn ? rest : [...rest, ...some] } };
}

export const isOn = ({ chosen }, list, some) => some.every((thing) => (chosen[list] ?? []).includes(thing));

const shown = new WeakMap(); // by scene: {hidden, scene} as it is shown
const whole = new WeakMap(); // and back

// The scene without what is hidden. Shapes keep their places in the list, by which the renderer's layers number them:
// rays pass through a hidden one.
export function visible(scene, hidden = []) {
  if (!hidden.length) return scene;
  const known = shown.get(scene);
  if (known?.hidden === hidden) return known.scene;
  const isHidden = (kind, i) => hidden.includes(pointer(kind, i));
  const { environment, lights, ...rest } = scene;
  const used = new Set(scene.shapes.filter((_, i) => isHidden("shapes", i)).map(({ material }) => material));
  const passed = [...used].map((name) => {
    const { emission, ...material } = scene.materials[name];
    return [unseen(name), { ...material, alpha: 0 }];
  });
  const made = {
    ...rest,
    ...(environment && !hidden.includes("/environment") ? { environment } : {}),
    ...(lights ? { lights: lights.filter((_, i) => !isHidden("lights", i)) } : {}),
    materials: { ...scene.materials, ...Object.fromEntries(passed) },
    shapes: scene.shapes.map((shape, i) =>
      isHidden("shapes", i) ? { ...shape, material: unseen(shape.material) } : shape,
    ),
  };
  shown.set(scene, { hidden, scene: made });
  whole.set(made, scene);
  return made;
}

// The scene with what is hidden in it.
export const entire = (scene) => whole.get(scene) ?? scene;
