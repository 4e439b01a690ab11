// How each render was looked at when it was asked for: its exposure and its tone map, with which it is shown and saved.
// The browser remembers them.

import { dismiss, recallAll, remember } from "../lib/browser-storage.js";

const NAME = "view "; // in the browser's storage, followed by the render's id

export class RenderViews {
  #known = new Map();

  // Reads what earlier visits left.
  async load() {
    for (const { name, value } of await recallAll(NAME)) {
      const id = name.slice(NAME.length);
      if (!this.#known.has(id)) this.#known.set(id, value);
    }
  }

  keep(id, view) {
    this.#known.set(id, view);
    remember(NAME + id, view);
  }

  // Undefined for one that another browser asked for.
  of(id) {
    return this.#known.get(id);
  }

  forget(ids) {
    for (const id of ids) {
      this.#known.delete(id);
      dismiss(NAME + id);
    }
  }
}
