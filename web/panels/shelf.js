// The shelf along the foot of the picture: the scene's materials and the library, environments and scenes, each a
// picture to choose.

import { fetchPreset } from "../server/api.js";
import { OWN } from "../document/editor.js";
import { carried, pictured } from "../document/material-set.js";
import { pointer } from "../lib/patch.js";
import { PictureList } from "../lib/picture-list.js";
import { element } from "../lib/dom.js";
import { inWords } from "../lib/format-text.js";
import { watchChoice } from "../lib/tabs.js";

const ALL = "all";
const SAVED = "saved";
const NONE = "(none)";
const LIBRARY = "application/x-sunbox-library"; // a material of the library, and one of the scene, that is dragged
const SCENE = "application/x-sunbox-material";

// A title without what stands in brackets: there is no room for that under a picture.
const short = (title) => title.replace(/ \(.*\)$/, "");

export class Shelf {
  #kind = ALL;
  #painted = new Map(); // the document that a material's picture was made of, by its name
  #materials = new Map(); // documents of the library that were fetched

  // `find(id)` elements; `library` as openLibrary has it; `acts` the editor; `thumbnails`; `saved` the SavedMaterials or
  // null; `shapeAt(x, y)` resolves to the index of the shape there or null; `rename(name)`, `remove(name)` of materials.
  constructor(find, { library, acts, thumbnails, saved, shapeAt, rename, remove }) {
    Object.assign(this, { find, library, acts, thumbnails, saved, shapeAt });
    this.materials = new PictureList(find("materials"), {
      choose: (name) => acts.pickMaterial(name),
      follows: true,
      keys: { Delete: remove, F2: rename },
      drag: (name) => ({ type: SCENE, text: name }),
    });
    find("materials").addEventListener("dblclick", ({ target }) => {
      const option = target.closest("[role=option]");
      if (option) rename(option.dataset.value);
    });
    this.shown = new PictureList(find("library"), {
      choose: (value) => this.#assign(value),
      keys: { Delete: (value) => this.#forget(value) },
      drag: (value) => ({ type: LIBRARY, text: value }),
    });
    this.environments = new PictureList(find("environments"), {
      choose: (name) => acts.pickEnvironment(name === NONE ? null : name),
    });
    this.scenes = new PictureList(find("scenes"), { choose: (name) => acts.pickScene(name) });
    this.#kinds();
    find("search-library").addEventListener("input", () => this.#list());
    find("forget-saved").addEventListener("click", () => this.#forget(this.shown.current ?? ""));
    this.#list();
    this.scenes.fill(
      library.scenes.map(({ name, title }) => ({ value: name, title, label: short(title) })),
      (image, name) => thumbnails.place(image, "scenes", name),
    );
    this.#drops(find("stage"));
  }

  // --- the library ---

  #kinds() {
    const counts = new Map();
    for (const { kind } of this.library.materials) if (kind) counts.set(kind, (counts.get(kind) ?? 0) + 1);
    const known = [...counts].sort((a, b) => b[1] - a[1]).map(([kind]) => kind); // those with the most come first
    const kinds = [ALL, ...(this.saved ? [SAVED] : []), ...known];
    this.find("kinds").replaceChildren(
      ...kinds.map((kind) =>
        element(
          "button",
          { type: "button", role: "tab", "data-kind": kind, "aria-controls": "library" },
          inWords(kind),
        ),
      ),
    );
    const mark = watchChoice(
      this.find("kinds"),
      "[role=tab]",
      ({ dataset }) => {
        this.#kind = dataset.kind;
        mark((tab) => tab.dataset.kind === this.#kind);
        this.#list();
      },
      "aria-selected",
    );
    mark((tab) => tab.dataset.kind === this.#kind);
  }

  // What the chosen kind and the words in the search leave of the library.
  #list() {
    const words = this.find("search-library").value.trim().toLowerCase();
    const presets = this.library.materials.filter(({ kind }) => [ALL, kind].includes(this.#kind));
    this.find("forget-saved").hidden = this.#kind !== SAVED || !this.saved.entries.length;
    const saved = [ALL, SAVED].includes(this.#kind) ? (this.saved?.entries ?? []) : [];
    this.shown.fill(
      [
        ...saved.map(({ name, title }) => ({ value: `${SAVED} ${name}`, title, label: title })),
        ...presets.map(({ name, title, kind }) => ({ value: name, title, kind, label: short(title) })),
      ].filter(({ title, kind = "" }) => `${title} ${kind}`.toLowerCase().includes(words)),
      (image, value) => {
        const fetch = () => this.#fetch(value);
        if (value.startsWith(`${SAVED} `)) this.thumbnails.later(image, fetch);
        else this.thumbnails.preset(image, value, fetch);
      },
    );
  }

  // Saved materials have come or gone.
  refresh() {
    this.#list();
  }

  async #fetch(value) {
    if (value.startsWith(`${SAVED} `)) return this.saved.fetch(value.slice(SAVED.length + 1));
    if (!this.#materials.has(value)) this.#materials.set(value, await fetchPreset("materials", value));
    return this.#materials.get(value);
  }

  async #assign(value) {
    try {
      this.acts.putMaterial(await this.#fetch(value));
      this.used = value;
      this.shown.mark(value);
    } catch (problem) {
      this.acts.complain(problem);
    }
  }

  #forget(value) {
    if (value.startsWith(`${SAVED} `)) this.saved.forget(value.slice(SAVED.length + 1));
  }

  // What is dragged onto the picture goes to what is under the pointer.
  #drops(stage) {
    stage.addEventListener("dragover", (event) => {
      if ([LIBRARY, SCENE].some((type) => event.dataTransfer.types.includes(type))) event.preventDefault();
    });
    stage.addEventListener("drop", async (event) => {
      const { clientX, clientY, dataTransfer } = event;
      const [taken, own] = [LIBRARY, SCENE].map((type) => dataTransfer.getData(type));
      if (!taken && !own) return;
      event.preventDefault();
      try {
        const shape = await this.shapeAt(clientX, clientY);
        if (shape === null) return;
        const thing = pointer("shapes", shape);
        if (own) this.acts.edit(`/scene${thing}/material`, own);
        this.acts.select(thing);
        if (taken) await this.#assign(taken);
      } catch (problem) {
        this.acts.complain(problem);
      }
    });
  }

  // --- what the state has ---

  show({ scene, chosen, home }) {
    const documents = Object.entries(scene.materials);
    this.materials.fill(documents.map(([name]) => ({ value: name, title: name })));
    for (const [name, document] of documents) {
      const image = this.materials.image(name);
      const now = pictured(document, scene, image.painted);
      if (now === image.painted) continue;
      image.painted = now;
      this.thumbnails.own(image, carried(name, document, scene));
    }
    this.materials.mark(chosen.material);
    if (this.used && this.#materials.get(this.used) !== scene.materials[chosen.material]) this.used = null;
    this.shown.mark(this.used ?? null);
    this.environments.fill(
      [
        { value: OWN, title: home.environment ? "The scene's own" : "The scene's own: none" },
        { value: NONE, title: "None (black)", label: "None" },
        ...this.library.environments.map(({ name, title }) => ({ value: name, title })),
      ],
      (image, name) => {
        if (name === OWN || name === NONE) this.thumbnails.plain(image, name === OWN ? 0.25 : 0);
        else this.thumbnails.place(image, "environments", name);
      },
    );
    this.environments.mark(chosen.environment ?? NONE);
    this.scenes.mark(chosen.scene);
  }
}
