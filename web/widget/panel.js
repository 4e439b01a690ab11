// Beside the picture of a notebook's view: menus of what is built in, and the chosen material's parameters.

import { element, freshId } from "../lib/dom.js";
import { isObject, pointer, put } from "../lib/patch.js";
import { schemaForm } from "../forms/schema-form.js";
import { fields, materialModels } from "../server/schema.js";

const option = (value, title = value) => element("option", { value }, title);

// A field that shows an image says which; the image is changed in the document.
function slot() {
  const chip = element("span", { class: "chip" });
  return {
    chip,
    show(value) {
      chip.hidden = !(isObject(value) && value.texture !== undefined);
      if (!chip.hidden) chip.textContent = value.texture;
    },
  };
}

// Fields that only name images or other files have nothing to slide.
const isSlid = ({ widget }) => !["texture", "file"].includes(widget);

// A menu that does something and then shows its name again.
function menu(title, entries, act) {
  const select = element(
    "select",
    {
      "aria-label": title,
      onchange: () => {
        const { value } = select;
        select.value = "";
        if (value) act(value);
      },
    },
    option("", `${title}…`),
    ...entries.map(({ name, title: words }) => option(name, words)),
  );
  return select;
}

// `current()` is the scene, `change(scene)` takes another one, `take(kind, name)` asks for a built-in document, `choose`
// for another material, and `home()` goes back to the camera that the scene came with.
export function panel({ schema, presets, current, change, take, choose, home }) {
  const models = materialModels(schema);
  const id = freshId("material");
  const materials = element("select", { id, onchange: () => choose(materials.value) });
  const place = element("div", { class: "parameters" });
  let name = "";
  let form = null; // {type, show, mark}: made anew for another model

  const give = (field, value) => change(put(current(), pointer("materials", name, field), value));

  const made = (type) => {
    const made = schemaForm(fields(schema, models[type]).filter(isSlid), {
      change: give,
      commit() {},
      forgive() {},
      slot,
    });
    place.replaceChildren(made.element);
    return { type, ...made };
  };

  const inside = element(
    "div",
    { class: "inside" },
    element(
      "div",
      { class: "menus" },
      menu("Scene", presets.scenes, (value) => take("scenes", value)),
      menu("Environment", presets.environments, (value) => take("environments", value)),
      element("button", { type: "button", onclick: home }, "Reset view"),
    ),
    element(
      "div",
      { class: "menus material" },
      element("label", { for: id }, "Material"),
      materials,
      menu("Library", presets.materials, (value) => take("materials", value)),
    ),
    place,
  );
  return {
    element: element("div", { class: "panel" }, inside),
    // The scene, and which of its materials is chosen.
    show(scene, chosen) {
      const names = Object.keys(scene.materials);
      if (names.join("\n") !== [...materials.options].map(({ value }) => value).join("\n"))
        materials.replaceChildren(...names.map((each) => option(each)));
      materials.value = chosen;
      name = chosen;
      const material = scene.materials[chosen];
      if (!material || !models[material.type]) {
        place.replaceChildren();
        form = null;
        return;
      }
      if (form?.type !== material.type) form = made(material.type);
      form.show(material);
    },
    // What the server says of a value that it refused, at its field where there is one; false where there is none.
    mark: (place, text) => {
      const [, , material, field] = place.split("/");
      return material === name && Boolean(form?.mark(field, text));
    },
  };
}
