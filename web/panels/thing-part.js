// The selected thing: which fields it has, where it stands, and what can be done with it.

import { element } from "../lib/dom.js";
import { added } from "../document/materials.js";
import { inWords } from "../lib/format-text.js";
import { OnDemand } from "../lib/on-demand.js";
import { at } from "../lib/patch.js";
import {
  cameraModels,
  environmentModels,
  fields,
  lightModels,
  shapeModels,
  transformModel,
} from "../server/schema.js";
import { schemaForm } from "../forms/schema-form.js";
import * as transforms from "../document/transforms.js";
import { isSet } from "../document/emission.js";
import { things } from "../document/things.js";

export class ThingPart {
  #made = null; // what the form was made for
  #forms = [];
  #newMaterial = element("option", {}, "New material");
  #lamp = { key: null, isOne: false }; // whether the selected thing is shown as a lamp

  // `find(id)` elements; `schema` of the scene; `acts` the editor; `stage` what Panel has; `environments` the presets.
  constructor(find, { schema, acts, stage, environments }) {
    Object.assign(this, { schema, acts, stage, environments });
    this.#find = find;
    // What environments and bodies have besides: it comes with a selection, or as a hand comes near.
    this.more = new OnDemand(
      () => import("./thing-more.js"),
      ({ ThingMore }) => new ThingMore(find, { schema, acts }),
      { complain: (problem) => acts.complain(problem), arrived: () => this.#showMore(acts.state.scene) },
    );
    this.more.nears(find("page-properties"));
    find("camera-type").append(
      ...Object.keys(cameraModels(schema)).map((type) => element("option", { value: type }, inWords(type))),
    );
    find("camera-type").addEventListener("change", ({ target }) => acts.turnCamera(target.value));
    find("lamp-more").addEventListener("click", () => this.#fold(!this.#isFolded));
    find("thing-material").addEventListener("change", ({ target }) => {
      if (target.selectedOptions[0] === this.#newMaterial)
        return acts.change(added(acts.state, "material", acts.plainMaterial));
      acts.edit(`/scene${this.thing}/material`, target.value);
      acts.select(this.thing);
    });
  }

  #find;

  // `thing` is what is selected; the material of none that is a shape stands alone.
  show({ scene, chosen }) {
    const all = things(scene);
    const isMaterial = chosen.thing.startsWith("/materials/");
    const before = this.thing;
    this.thing = isMaterial || all.some(({ thing }) => thing === chosen.thing) ? chosen.thing : "/camera";
    const own = all.find(({ thing }) => thing === this.thing);
    this.#showLamp(scene);
    this.#find("thing-part").hidden = !own;
    this.#find("film-part").hidden = this.thing !== "/camera";
    this.#find("material-part").hidden = Boolean(own) && !this.thing.startsWith("/shapes/");
    if (own) this.#showThing(scene, own);
    else this.#made = null;
    const isWanted = this.#lamp.isOne || this.thing === "/environment" || at(scene, this.thing)?.medium;
    if (isWanted || (before && before !== this.thing)) this.more.get().catch(this.more.complain);
    this.#showMore(scene);
    const { environment } = chosen;
    const name = this.environments.find((each) => each.name === environment)?.title;
    this.#find("environment-name").textContent =
      name ?? chosen.environmentFile ?? (environment === null ? "" : "The scene's own");
  }

  #model(document) {
    if (this.thing === "/camera") return cameraModels(this.schema)[this.acts.camera.type];
    const models = { environment: environmentModels, lights: lightModels, shapes: shapeModels }[
      this.thing.split("/")[1]
    ];
    return models?.(this.schema)[document?.type];
  }

  #showMore(scene) {
    const owner = this.#model(at(scene, this.thing));
    this.more.now?.show(scene, this.thing, owner, this.#lamp.isOne);
  }

  // A lamp has a form of its own, and what it is besides stands below that, folded. A thing that becomes one, or ceases to
  // be one, under the hand stays what it was.
  #showLamp(scene) {
    const { type, material } = at(scene, this.thing) ?? {};
    const key = [this.thing, type, material].join(" ");
    const page = this.#find("page-properties");
    if (key === this.#lamp.key && page.contains(document.activeElement)) return;
    const isOne = isSet(scene, this.thing);
    const isOther = isOne !== this.#lamp.isOne;
    this.#lamp = { key, isOne };
    if (!isOther) return;
    this.#find("lamp-more").hidden = !isOne;
    const [own, body] = [this.#find("thing-part"), this.#find("material-part")];
    if (isOne) body.before(own);
    else body.after(own);
    this.#fold(this.#isFolded);
  }

  #isFolded = true;

  #fold(isFolded) {
    this.#isFolded = isFolded;
    const { isOne } = this.#lamp;
    this.#find("page-properties").dataset.lamp = isOne ? (isFolded ? "folded" : "open") : "none";
    this.#find("lamp-more").setAttribute("aria-expanded", String(!isFolded));
  }

  #showThing(scene, { title }) {
    const document = at(scene, this.thing);
    const isShape = this.thing.startsWith("/shapes/");
    this.#find("thing-title").textContent = title;
    this.#find("environment-name").hidden = this.thing !== "/environment";
    this.#find("reset-view").hidden = this.thing !== "/camera";
    this.#find("thing-material-row").hidden = !isShape;
    this.#find("camera-type-row").hidden = this.thing !== "/camera";
    this.#find("camera-type").value = this.acts.camera.type;
    if (isShape) {
      const names = Object.keys(scene.materials);
      this.#find("thing-material").replaceChildren(
        ...names.map((name) => element("option", { value: name }, name)),
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

  // Those of a model; a lamp's strength and angles are in its own form.
  #fields(owner) {
    const all = fields(this.schema, owner);
    if (!this.thing.startsWith("/lights/")) return all;
    return all.filter(({ widget, unit }) => widget !== "color" && unit !== "degrees");
  }

  #make(kind, document, isShape) {
    this.#made = kind;
    const own = this.#model(document);
    const parts = own
      ? [
          {
            place: this.thing,
            fields: this.#fields(own).map((field) =>
              this.thing === "/environment" && field.name === "scale" ? { ...field, widget: "strength" } : field,
            ),
            read: (values) => values ?? {},
            change: (name, value) => this.acts.edit(`/scene${this.thing}/${name}`, value),
          },
        ]
      : [];
    if (isShape) parts.push(this.#transform(document));
    this.#forms = parts.map(({ fields: chosen, change, ...part }) => ({
      ...part,
      form: schemaForm(chosen, { change, commit: () => this.acts.endGesture(), forgive: () => this.acts.forgive() }),
    }));
    const removable = this.acts.removable(this.thing);
    const button = (label, does) =>
      element("button", { type: "button", class: "button small", onclick: does }, label);
    const thing = this.thing;
    this.#find("thing-acts").replaceChildren(
      ...[
        isShape ? button("Frame", () => this.stage.frame(thing)) : null,
        isShape && this.stage.poses()?.has(document) ? button("Pose…", () => this.#pose(thing)) : null,
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
    const rotation = this.#find("thing-form").querySelector("[data-field=rotation] input[type=range]");
    rotation?.setAttribute("aria-label", "Environment rotation");
  }

  #pose(thing) {
    return this.stage.poses().ask(Number(thing.split("/")[2]));
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
    return this.more.now?.mark(wrong, text) ?? null;
  }

  forgive() {
    for (const { form } of this.#forms) form.forgive();
    this.more.now?.forgive();
  }
}
