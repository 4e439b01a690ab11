// Pickers for the presets that the server offers: scenes and environments as lists, materials as pictures.

import { fetchPreset, listPresets } from "../server/api.js";
import { element } from "../lib/dom.js";
import { equal } from "../lib/patch.js";

const KINDS = ["scenes", "materials", "environments"];

// {scenes: [{name, title}], materials: ..., environments: ...}
export async function openLibrary() {
  const lists = await Promise.all(KINDS.map(listPresets));
  return Object.fromEntries(KINDS.map((kind, i) => [kind, lists[i]]));
}

// A list of {name, title} whose choice calls `pick(name)`.
export function fillPicker(select, entries, pick) {
  select.replaceChildren(...entries.map(({ name, title }) => element("option", { value: name }, title)));
  select.addEventListener("change", () => pick(select.value));
}

// Buttons for the material presets; `pick(document)` gets the one chosen, `show(material)` marks the one in use.
// `paint(img, name, fetch)` puts the service's picture of it into the button.
export function materialButtons(root, entries, { pick, fail, paint }) {
  const documents = new Map();
  const fetchOne = async (name) => {
    if (!documents.has(name)) documents.set(name, await fetchPreset("materials", name));
    return documents.get(name);
  };
  let last = null; // the last one picked
  const buttons = new Map(
    entries.map(({ name, title }) => {
      const picture = element("img", { class: "thumb", alt: "", width: "64", height: "64" });
      const button = element(
        "button",
        {
          type: "button",
          class: "preset",
          title,
          "aria-pressed": "false",
          "data-name": name,
          onclick: async () => {
            try {
              const document = await fetchOne(name);
              last = name;
              pick(document);
            } catch (problem) {
              fail(problem);
            }
          },
        },
        picture,
        element("span", {}, title),
      );
      paint(picture, name, () => fetchOne(name));
      return [name, button];
    }),
  );
  root.replaceChildren(...buttons.values());
  return {
    show(material) {
      for (const [name, button] of buttons) {
        button.setAttribute("aria-pressed", String(name === last && equal(documents.get(name), material)));
      }
    },
  };
}
