// The shelf along the foot of the picture: the scene's materials and the library, environments and scenes, each a
// picture to choose.

import { fetchPreset } from "../server/api.js";
import { OWN } from "../document/editor.js";
import { carried, pictured } from "../document/material-set.js";
import { isWorn } from "../document/materials.js";
import { Carrier } from "./carrier.js";
import { PictureList } from "../lib/picture-list.js";
import { element } from "../lib/dom.js";
import { amount, inWords } from "../lib/format-text.js";
import { watchChoice } from "../lib/tabs.js";

const ALL = "all";
const SAVED = "saved";
const SAVED_START = new RegExp(`^${SAVED} `);
const NONE = "(none)";
const PAGE = crypto.getRandomValues(new Uint32Array(2)).join("-"); // tells its own materials from another page's

// A title without what stands in brackets: there is no room for that under a picture.
const short = (title) => title.replace(/ \(.*\)$/, "");

export class Shelf {
  #kind = ALL;
  #painted = new Map(); // the document that a material's picture was made of, by its name
  #materials = new Map(); // documents of the library that were fetched
  #origins = new WeakMap(); // what of the library a material of the scene came from
  #scrolls = new Map(); // how far the library was scrolled, by kind
  #kindBefore = null; // the kind that was open before a search began; null while nobody searches

  // `find(id)` elements; `library` as openLibrary has it; `acts` the editor; `thumbnails`; `saved` the SavedMaterials or
  // null; `rename(name)`, `remove(name)` of materials; `carry`: what Carrier needs beside these.
  constructor(find, { library, acts, thumbnails, saved, rename, remove, carry }) {
    Object.assign(this, { find, library, acts, thumbnails, saved });
    const carrier = new Carrier({ ...carry, acts, open: (parcel) => this.#open(parcel) });
    this.materials = new PictureList(find("materials"), {
      choose: (name) => acts.pickMaterial(name),
      follows: true,
      keys: { Delete: remove, F2: rename },
      carry: carrier.source((name) => ({ page: PAGE, name, document: this.#carried(name) })),
    });
    find("materials").addEventListener("dblclick", ({ target }) => {
      const option = target.closest("[role=option]");
      if (option) rename(option.dataset.value);
    });
    this.shown = new PictureList(find("library"), {
      choose: (value) => this.#assign(value),
      keys: { Delete: (value) => this.#forget(value) },
      carry: carrier.source((library) => ({ library })),
    });
    this.environments = new PictureList(find("environments"), {
      choose: (name) => acts.pickEnvironment(name === NONE ? null : name),
    });
    this.scenes = new PictureList(find("scenes"), { choose: (name) => acts.pickScene(name) });
    this.#kinds();
    find("search-library").addEventListener("input", () => this.#search());
    find("library").addEventListener("scroll", ({ target }) => {
      if (this.#kindBefore === null) this.#scrolls.set(this.#kind, target.scrollLeft);
    });
    find("forget-saved").addEventListener("click", () => this.#forget(this.shown.current ?? ""));
    this.#list();
    this.scenes.fill(
      library.scenes.map(({ name, title, group }) => ({ value: name, title, label: short(title), group })),
      (image, name) => thumbnails.place(image, "scenes", name),
    );
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
          kind === SAVED ? "Mine" : inWords(kind),
        ),
      ),
    );
    this.markKind = watchChoice(
      this.find("kinds"),
      "[role=tab]",
      ({ dataset }) => this.#openKind(dataset.kind),
      "aria-selected",
    );
    this.markKind((tab) => tab.dataset.kind === this.#kind);
  }

  #openKind(kind) {
    this.#kind = kind;
    this.markKind((tab) => tab.dataset.kind === kind);
    this.#list();
  }

  // A search goes through all kinds, unless one is chosen meanwhile; after it the kind before is open again.
  #search() {
    const isSearching = this.find("search-library").value.trim() !== "";
    if (isSearching === (this.#kindBefore !== null)) return this.#list();
    const kind = isSearching ? ALL : this.#kind === ALL ? this.#kindBefore : this.#kind;
    this.#kindBefore = isSearching ? this.#kind : null;
    return this.#openKind(kind);
  }

  get #entries() {
    return [
      ...(this.saved?.entries ?? []).map(({ name, title }) => ({
        value: `${SAVED} ${name}`,
        title,
        kind: SAVED,
        label: title,
      })),
      ...this.library.materials.map(({ name, title, kind = "", source }) => ({
        value: name,
        title,
        kind,
        label: short(title),
        hint: source ? `${title}. ${source}` : title,
      })),
    ];
  }

  // What the chosen kind and the words in the search leave of the library.
  #list() {
    const words = this.find("search-library").value.trim();
    const found = this.#entries.filter(({ title, kind }) =>
      `${title} ${kind === SAVED ? "" : kind}`.toLowerCase().includes(words.toLowerCase()),
    );
    const shown = found.filter(({ kind }) => [ALL, kind].includes(this.#kind));
    this.find("forget-saved").hidden = this.#kind !== SAVED || !this.saved.entries.length;
    this.shown.fill(shown, (image, value) => {
      const fetch = () => this.#fetch(value);
      if (value.startsWith(`${SAVED} `)) this.thumbnails.saved(image, fetch);
      else this.thumbnails.preset(image, value, fetch);
    });
    if (this.#kindBefore === null) this.find("library").scrollLeft = this.#scrolls.get(this.#kind) ?? 0;
    this.#tellNone(shown, found, words);
  }

  // Words in the place of a row without pictures.
  #tellNone(shown, found, words) {
    if (shown.length) return this.find("no-hit").replaceChildren();
    const isElsewhere = words && found.length;
    const text = words ? `Nothing ${isElsewhere ? "here " : ""}is called “${words}”.` : "Nothing is saved yet.";
    const button = isElsewhere
      ? element(
          "button",
          { type: "button", class: "button small", onclick: () => this.#openKind(ALL) },
          `Show ${amount(found.length, "material")} of other kinds`,
        )
      : "";
    return this.find("no-hit").replaceChildren(text, button);
  }

  // Saved materials have come or gone; the one that was saved just now shows what is on the stage, until it is rendered.
  async refresh(changed = null) {
    this.#list();
    const value = `${SAVED} ${changed}`;
    const image = this.shown.image(value);
    if (!image) return;
    await this.thumbnails.atOnce(image, this.find("picture"));
    this.thumbnails.later(image, () => this.#fetch(value));
  }

  async #fetch(value) {
    if (value.startsWith(`${SAVED} `)) return this.saved.fetch(value.slice(SAVED.length + 1));
    if (!this.#materials.has(value)) {
      this.#materials.set(value, await fetchPreset("materials", value));
      this.thumbnails.knows(value, this.#materials.get(value));
    }
    return this.#materials.get(value);
  }

  // What it is called in a scene.
  #titleOf(value) {
    const saved = this.saved?.entries.find(({ name }) => `${SAVED} ${name}` === value);
    if (saved) return saved.title;
    const known = this.library.materials.find(({ name }) => name === value);
    return known ? short(known.title) : value.replace(SAVED_START, "");
  }

  async #assign(value) {
    try {
      await this.acts.assign(await this.#fetch(value), this.#titleOf(value));
      this.#origins.set(this.acts.material, value);
      this.shown.mark(value);
    } catch (problem) {
      this.acts.complain(problem);
    }
  }

  #forget(value) {
    if (value.startsWith(`${SAVED} `)) this.saved.forget(value.slice(SAVED.length + 1));
  }

  // What is carried, by its parcel: of this page a material of the scene, else what can come into any scene.
  async #open({ page, name, document, library }) {
    if (page === PAGE) return { name };
    if (!library) return { document, wanted: name };
    return { document: await this.#fetch(library), wanted: this.#titleOf(library) };
  }

  #carried(name) {
    const { scene } = this.acts.state;
    return carried(name, scene.materials[name], scene);
  }

  // --- what the state has ---

  show({ scene, chosen, home }) {
    const documents = Object.entries(scene.materials);
    this.materials.fill(documents.map(([name]) => ({ value: name, title: name })));
    for (const [name, document] of documents) {
      const image = this.materials.image(name);
      const now = pictured(document, scene, image.painted);
      if (now === image.painted && isWorn(scene, name) === image.isWorn) continue;
      Object.assign(image, { painted: now, isWorn: isWorn(scene, name) });
      this.thumbnails.own(image, this.#carried(name), image.isWorn);
    }
    this.materials.mark(chosen.material);
    this.shown.mark(this.#origins.get(this.acts.material) ?? null);
    this.environments.fill(
      [
        {
          value: OWN,
          title: home.environment ? "The scene's own" : "The scene's own: none",
          label: "Scene's own",
        },
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
