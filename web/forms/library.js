// The presets that the server offers, and a list to pick from.

import { listPresets } from "../server/api.js";
import { element } from "../lib/dom.js";

const KINDS = ["scenes", "materials", "environments"];

// {scenes: [{name, title}], materials: [{name, title, kind}], environments: [{name, title}]}
export async function openLibrary() {
  const lists = await Promise.all(KINDS.map(listPresets));
  return Object.fromEntries(KINDS.map((kind, i) => [kind, lists[i]]));
}

// A list of {name, title} whose choice calls `pick(name)`.
export function fillPicker(select, entries, pick) {
  select.replaceChildren(...entries.map(({ name, title }) => element("option", { value: name }, title)));
  select.addEventListener("change", () => pick(select.value));
}
