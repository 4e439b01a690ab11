// What opens under the scene's name: its file, names on the server, snapshots in this browser.

import * as api from "../server/api.js";
import { ask } from "../lib/ask.js";
import { element, freshId } from "../lib/dom.js";
import { WHOSE } from "./saved-materials.js";
import { dismiss, recallAll, remember } from "../lib/browser-storage.js";
import { SNAPSHOT } from "../document/variants.js";

const button = (label, does, more = {}) =>
  element("button", { type: "button", class: "button small", onclick: does, ...more }, label);

export class SceneMenu {
  // `acts` has scene(), title(), open(document, title), named(title), state(), snapshot() -> {blob, note},
  // restore(essence), openFiles(), addFiles(), showKeys(), toggleTheme(), complain(error), announce(text).
  constructor(root, { acts }) {
    this.acts = acts;
    const files = element(
      "div",
      { class: "row" },
      button("Open file…", acts.openFiles, {
        id: "open-file",
        title: "A model or a scene in place of this one (Ctrl+O)",
      }),
      button("Add file…", acts.addFiles, {
        id: "add-file",
        title: "A model beside what is here, an image, an environment",
      }),
    );
    root.replaceChildren(
      this.#saved(),
      this.#group(
        "Files",
        files,
        element("p", { class: "note" }, "Or drop a model, an environment or an image on the picture."),
      ),
      this.#snapshots(),
      // Where the header has no room for their buttons.
      element(
        "div",
        { class: "row narrow" },
        button("Keys and gestures", acts.showKeys),
        button("Light or dark", acts.toggleTheme),
      ),
    );
  }

  // Call before it is shown.
  refresh() {
    if (document.activeElement !== this.name) this.name.value = this.acts.title();
    this.refreshSnapshots();
    this.refreshSaved();
  }

  async #try(work) {
    try {
      return await work();
    } catch (error) {
      this.acts.complain(error);
      return null;
    }
  }

  #group(title, ...children) {
    return element("section", { class: "group" }, element("h2", {}, title), ...children);
  }

  // --- names on the server ---

  #saved() {
    const id = freshId("name");
    this.name = element("input", {
      class: "entry",
      id,
      placeholder: "Name",
      maxlength: "100",
      autocomplete: "off",
      spellcheck: "false",
      onkeydown: ({ key }) => {
        if (key === "Enter") this.#save();
      },
    });
    this.list = element("ul", { class: "kept" });
    return this.#group(
      "Saved scenes",
      element(
        "div",
        { class: "row" },
        element("label", { for: id, class: "unseen" }, "Name of the scene"),
        this.name,
        button("Save", () => this.#save()),
      ),
      this.list,
    );
  }

  #save() {
    return this.#try(async () => {
      const wanted = this.name.value.trim();
      if (!wanted) return this.name.focus();
      const taken = (await api.listSaved("scenes")).some((each) => (each.title ?? each.name) === wanted);
      if (taken && !(await ask({ title: `Replace “${wanted}”?`, detail: WHOSE, yes: "Replace" }))) return null;
      await api.save("scenes", wanted, this.acts.scene());
      this.acts.named(wanted);
      this.acts.announce(`Saved ${wanted}.`);
      return this.refreshSaved();
    });
  }

  async refreshSaved() {
    const all = await this.#try(() => api.listSaved("scenes"));
    if (!all) return;
    const open = (name, title) => this.#try(async () => this.acts.open(await api.fetchSaved("scenes", name), title));
    const forget = (name, title) =>
      this.#try(async () => {
        if (!(await ask({ title: `Delete “${title}”?`, detail: WHOSE, yes: "Delete" }))) return;
        await api.forget("scenes", name);
        await this.refreshSaved();
      });
    this.list.replaceChildren(
      ...all.map(({ name, title = name }) =>
        element(
          "li",
          {},
          element("button", { type: "button", class: "open", title, onclick: () => open(name, title) }, title),
          element(
            "button",
            { type: "button", class: "forget", "aria-label": `Delete ${title}`, onclick: () => forget(name, title) },
            "×",
          ),
        ),
      ),
    );
    if (!all.length) this.list.replaceChildren(element("li", { class: "note" }, "No scene is saved yet."));
  }

  // --- snapshots in the browser ---

  #snapshots() {
    this.shots = element("div", { class: "snapshots" });
    return this.#group(
      "Snapshots",
      element("p", { class: "note" }, "The scene as it is now, kept in this browser."),
      element(
        "div",
        { class: "row" },
        button("Take a snapshot", () => this.snapshot()),
      ),
      this.shots,
    );
  }

  snapshot() {
    return this.#try(async () => {
      await remember(SNAPSHOT + new Date().toISOString(), {
        ...(await this.acts.snapshot()),
        state: this.acts.state(),
      });
      this.acts.announce("Snapshot taken.");
      await this.refreshSnapshots();
    });
  }

  async refreshSnapshots() {
    const all = (await recallAll(SNAPSHOT)).reverse();
    for (const image of this.shots.querySelectorAll("img")) URL.revokeObjectURL(image.src);
    this.shots.replaceChildren(
      ...all.map(({ name, value }) => {
        const taken = new Date(name.slice(SNAPSHOT.length));
        const when = taken.toLocaleString([], { dateStyle: "short", timeStyle: "short" });
        return element(
          "figure",
          { class: "snapshot" },
          element(
            "button",
            {
              type: "button",
              class: "open",
              "aria-label": `Go back to the snapshot of ${when}`,
              onclick: () => this.acts.restore(value.state),
            },
            element("img", { alt: "", src: URL.createObjectURL(value.blob) }),
          ),
          element("p", {}, `${when} · ${value.note}`),
          element(
            "button",
            {
              type: "button",
              class: "forget",
              "aria-label": `Delete the snapshot of ${when}`,
              onclick: async () => {
                if (!(await ask({ title: "Delete this snapshot?", detail: "This cannot be undone.", yes: "Delete" })))
                  return;
                await dismiss(name);
                await this.refreshSnapshots();
              },
            },
            "×",
          ),
        );
      }),
    );
  }
}
