// What the scene contains, as a list to pick from; and which fields the picked thing has.

import { element } from "../lib/dom.js";
import { added } from "../document/materials.js";
import { at, equal, pointer } from "../lib/patch.js";
import { environmentModels, fields, lightModels, model, shapeModels, transformModel } from "../server/schema.js";
import { schemaForm } from "../forms/schema-form.js";
import * as transforms from "../document/transforms.js";
import { things } from "../document/things.js";
import { icon } from "../lib/icon.js";
import { inWords } from "../lib/format-text.js";

export class Outliner {
  #shown = null;
  #made = null; // what the form was made for
  #forms = [];
  #newMaterial = element("option", {}, "New material");

  // `acts` is the editor, `stage` what Panel has; `root` the panel.
  constructor(root, schema, acts, stage) {
    this.stage = stage;
    this.root = root;
    this.schema = schema.scene;
    this.acts = acts;
    this.list = this.#find("outline-list");
    this.list.addEventListener("click", ({ target }) => {
      const row = target.closest("[data-thing]");
      if (row) acts.select(row.dataset.thing);
    });
    this.list.addEventListener("keydown", (event) => this.#walk(event));
    this.#find("thing-material").addEventListener("change", ({ target }) => {
      if (target.selectedOptions[0] === this.#newMaterial)
        return acts.change(added(acts.state, "material", acts.plainMaterial));
      acts.edit(`/scene${this.thing}/material`, target.value);
      acts.select(this.thing);
    });
  }

  #find(id) {
    return this.root.querySelector(`#${id}`);
  }

  #walk(event) {
    const all = this.#shown.map(({ thing }) => thing);
    const now = all.indexOf(this.thing);
    const to = { ArrowDown: now + 1, ArrowUp: now - 1, Home: 0, End: all.length - 1 }[event.key];
    if (to === undefined) return;
    this.acts.select(all[Math.min(Math.max(to, 0), all.length - 1)]);
    event.preventDefault();
  }

  show(state) {
    const { scene, chosen } = state;
    const list = things(scene);
    this.thing = list.some(({ thing }) => thing === chosen.thing) ? chosen.thing : "/camera";
    if (!equal(list, this.#shown)) {
      this.#shown = list;
      this.list.replaceChildren(
        ...list.map((each) =>
          element(
            "li",
            { role: "option", "data-thing": each.thing, id: `thing${each.thing.replaceAll("/", "-")}` },
            icon(each.icon),
            element("span", {}, each.title),
            element("span", { class: "dim" }, each.note),
          ),
        ),
      );
    }
    for (const row of this.list.children) {
      const isIt = row.dataset.thing === this.thing;
      if (isIt && row.getAttribute("aria-selected") !== "true") row.scrollIntoView({ block: "nearest" });
      row.setAttribute("aria-selected", String(isIt));
    }
    this.list.setAttribute("aria-activedescendant", `thing${this.thing.replaceAll("/", "-")}`);
    this.#showThing(
      scene,
      list.find(({ thing }) => thing === this.thing),
    );
  }

  #model(document) {
    if (this.thing === "/camera") return model(this.schema, this.schema, "camera");
    const models = { environment: environmentModels, lights: lightModels, shapes: shapeModels }[
      this.thing.split("/")[1]
    ];
    return models(this.schema)[document?.type];
  }

  #showThing(scene, { title }) {
    const document = at(scene, this.thing);
    const isShape = this.thing.startsWith("/shapes/");
    this.#find("thing-title").textContent = title;
    this.#find("environment-picker").hidden = this.thing !== "/environment";
    this.#find("reset-view").hidden = this.thing !== "/camera";
    this.#find("thing-material-row").hidden = !isShape;
    if (isShape) {
      const names = Object.keys(scene.materials);
      this.#find("thing-material").replaceChildren(
        ...names.map((name) => element("option", { value: name }, inWords(name))),
        element("hr"),
        this.#newMaterial,
      );
      this.#find("thing-material").value = document.material;
    }
    const marks = [
      transforms.isSkewed(document?.transform) && "skewed",
      this.acts.removable(this.thing) && "removable",
    ].filter(Boolean);
    const kind = [this.thing, document?.type, ...marks].join(" ");
    if (kind !== this.#made) this.#make(kind, document, isShape);
    for (const { place, form, read } of this.#forms) form.show(read(at(scene, place)));
  }

  #make(kind, document, isShape) {
    this.#made = kind;
    const own = this.#model(document);
    const parts = own
      ? [
          {
            place: this.thing,
            fields: fields(this.schema, own),
            read: (values) => values ?? {},
            change: (name, value) => this.acts.edit(`/scene${this.thing}/${name}`, value),
          },
        ]
      : [];
    if (isShape) parts.push(this.#transform(document));
    this.#forms = parts.map(({ fields: chosen, change, ...part }) => ({
      ...part,
      form: schemaForm(chosen, { change, commit: () => this.acts.rest(), forgive: () => this.acts.forgive() }),
    }));
    const removable = this.acts.removable(this.thing);
    const button = (label, does) =>
      element("button", { type: "button", class: "button small", onclick: does }, label);
    const thing = this.thing;
    this.#find("thing-acts").replaceChildren(
      ...[
        isShape ? button("Frame", () => this.stage.frame(thing)) : null,
        /^\/(shapes|lights)\//.test(thing) ? button("Duplicate", () => this.stage.duplicate(thing)) : null,
        removable ? button("Delete", () => this.acts.remove(thing)) : null,
      ].filter(Boolean),
    );
    this.#find("thing-form").replaceChildren(
      ...this.#forms.flatMap(({ title, note, form }) =>
        [title && element("h3", {}, title), note && element("p", { class: "note" }, note), form.element].filter(
          Boolean,
        ),
      ),
    );
  }

  // Imported parts stand by a matrix: the form shows it as a move, a turn and a scale, which an edit makes of it.
  #transform({ transform }) {
    const place = `${this.thing}/transform`;
    const isSkewed = transforms.isSkewed(transform);
    return {
      title: "Transform",
      place,
      read: transforms.shown,
      note: isSkewed ? "This part is skewed in its file: it can be moved, but not turned or scaled." : "",
      fields: fields(this.schema, transformModel(this.schema)).filter(
        ({ name }) => !isSkewed || name === "translate",
      ),
      change: (name, value) => {
        const now = at(this.acts.state.scene, place);
        this.acts.edit(`/scene${place}`, transforms.changed(now, name, value), `/scene${place}/${name}`);
      },
    };
  }

  // As Panel.mark: the control's place, or null.
  mark(wrong, text) {
    for (const { place, form } of this.#forms) {
      if (!wrong.startsWith(`/scene${place}/`)) continue;
      const [name] = wrong.slice(place.length + 7).split("/");
      if (form.mark(name, text)) return `/scene${place}/${name}`;
    }
    return null;
  }

  forgive() {
    for (const { form } of this.#forms) form.forgive();
  }
}

// New things, in the middle of what is looked at: [{title, kind, make(camera, materials)}].
export function additions(schema) {
  const shapes = shapeModels(schema);
  const lights = lightModels(schema);
  const near = ({ target }) => target.map((x) => Number(x.toFixed(3)));
  const above = ({ target, position }) => {
    const far = Math.hypot(...target.map((x, i) => x - position[i]));
    return {
      point: target.map((x, i) => Number((x + [0.3, 0.6, 0.3][i] * far).toFixed(3))),
      strength: Number((far * far * 2).toPrecision(2)),
    };
  };
  const all = [
    {
      title: "Sphere",
      kind: "shapes",
      needs: shapes.sphere,
      make: (c, r, material) => ({ type: "sphere", center: near(c), radius: r, material }),
    },
    {
      title: "Box",
      kind: "shapes",
      needs: shapes.box,
      make: (c, r, material) => ({
        type: "box",
        min: near(c).map((x) => x - r),
        max: near(c).map((x) => x + r),
        material,
      }),
    },
    {
      title: "Quad",
      kind: "shapes",
      needs: shapes.quad,
      make: (c, r, material) => ({
        type: "quad",
        origin: near(c).map((x, i) => x + [-r, 0, r][i]),
        u: [2 * r, 0, 0],
        v: [0, 0, -2 * r],
        material,
      }),
    },
    {
      title: "Point light",
      kind: "lights",
      needs: lights.point,
      make: (c) => ({ type: "point", position: above(c).point, intensity: above(c).strength }),
    },
    {
      title: "Spot light",
      kind: "lights",
      needs: lights.spot,
      make: (c) => ({
        type: "spot",
        position: above(c).point,
        direction: near(c).map((x, i) => Number((x - above(c).point[i]).toFixed(3))),
        intensity: 2 * above(c).strength,
        inner_angle: 20,
        outer_angle: 30,
      }),
    },
    {
      title: "Sun",
      kind: "lights",
      needs: lights.directional,
      make: () => ({ type: "directional", direction: [-0.4, -1, -0.5], irradiance: 3, angular_diameter: 0.53 }),
    },
  ];
  return all.filter(({ needs }) => needs);
}
