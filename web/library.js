// Pickers for the presets that the server offers: scenes and environments as lists, materials as swatches.

import { fetchPreset, listPresets } from "./api.js";
import { hex, linear } from "./color.js";
import { element } from "./dom.js";
import { equal } from "./patch.js";

const KINDS = ["scenes", "materials", "environments"];

// The choice of the environment that the scene came with.
export const OWN = "";

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

// A hint of what the material looks like, until the service renders thumbnails of its own.
function paint(swatch, material) {
  const glow = linear(material.emission ?? 0);
  const brightest = Math.max(...glow);
  const tint = brightest > 0 ? glow.map((x) => x / brightest) : linear(material.base_color ?? material.albedo ?? 0.5);
  const roughness = material.roughness ?? 1;
  const metallic = material.metallic ?? 0;
  swatch.style.setProperty("--tint", hex(tint));
  swatch.style.setProperty("--shade", hex(tint.map((x) => x * (brightest > 0 ? 0.8 : 0.25 - 0.15 * metallic))));
  swatch.style.setProperty("--gleam", hex(tint.map((x) => x * metallic + (1 - metallic) * 1)));
  swatch.style.setProperty("--spread", `${Math.round(8 + 45 * roughness)}%`);
  swatch.style.setProperty("--strength", String(1 - 0.75 * roughness));
}

// Buttons for the material presets; `pick(document)` gets the one chosen, `show(material)` marks the one in use.
export function materialButtons(root, entries, pick, fail) {
  const documents = new Map();
  let current = null;
  const show = (material) => {
    current = material;
    for (const [name, button] of buttons) {
      button.setAttribute("aria-pressed", String(documents.has(name) && equal(documents.get(name), material)));
    }
  };
  const buttons = new Map(entries.map(({ name, title }) => {
    const swatch = element("span", { class: "swatch", "aria-hidden": "true" });
    const button = element("button", {
      type: "button", class: "preset", title, "aria-pressed": "false", "data-name": name,
      onclick: async () => {
        try {
          pick(documents.get(name) ?? (await fetchPreset("materials", name)));
        } catch (problem) {
          fail(problem);
        }
      },
    }, swatch, element("span", {}, title));
    fetchPreset("materials", name).then((document) => {
      documents.set(name, document);
      paint(swatch, document);
      show(current);
    }).catch(() => {}); // only the swatch stays grey; the button asks again
    return [name, button];
  }));
  root.replaceChildren(...buttons.values());
  return { show };
}
