// The page that saves and shares: names on the server, snapshots in this browser, files, a link, a command.

import * as api from "../server/api.js";
import { ask } from "../lib/ask.js";
import { element, freshId } from "../lib/dom.js";
import { jsonBlob, saveAs } from "../lib/files.js";
import { dismiss, recallAll, remember } from "../lib/browser-storage.js";
import { inWords } from "../lib/format-text.js";

const KINDS = ["scenes", "materials"];
const SNAPSHOT = "snapshot ";
const WHOSE = "Everybody who uses this server has it, and this cannot be undone.";

const button = (label, does, more = {}) =>
  element("button", { type: "button", class: "button small", onclick: does, ...more }, label);

export class SavePage {
  // `acts` has document(kind), open(kind, document, name), state(), snapshot() -> {blob, note}, restore(essence),
  // link(), command(), png(bits), exr(), complain(error), announce(text).
  constructor(root, { acts, hasDocuments }) {
    this.root = root;
    this.acts = acts;
    this.lists = {};
    const groups = [this.#snapshots(), this.#files(), this.#sharing()];
    if (hasDocuments) groups.unshift(...KINDS.map((kind) => this.#saved(kind)));
    root.replaceChildren(...groups);
    this.refreshSnapshots();
    if (hasDocuments) KINDS.forEach((kind) => this.refresh(kind));
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

  #saved(kind) {
    const id = freshId("name");
    const name = element("input", {
      class: "entry",
      id,
      placeholder: "Name",
      maxlength: "100",
      autocomplete: "off",
      spellcheck: "false",
    });
    const save = () =>
      this.#try(async () => {
        const wanted = name.value.trim();
        if (!wanted) return name.focus();
        const taken = (await api.listSaved(kind)).some((each) => (each.title ?? each.name) === wanted);
        if (taken && !(await ask({ title: `Replace “${wanted}”?`, detail: WHOSE, yes: "Replace" }))) return null;
        await api.save(kind, wanted, this.acts.document(kind));
        name.value = "";
        this.acts.announce(`Saved ${wanted}.`);
        await this.refresh(kind);
      });
    name.addEventListener("keydown", ({ key }) => {
      if (key === "Enter") save();
    });
    this.lists[kind] = element("ul", { class: "kept" });
    return this.#group(
      kind === "scenes" ? "Scenes on the server" : "Materials on the server",
      element(
        "div",
        { class: "row" },
        element("label", { for: id, class: "unseen" }, `Name of the ${kind === "scenes" ? "scene" : "material"}`),
        name,
        button("Save", save),
      ),
      this.lists[kind],
    );
  }

  async refresh(kind) {
    const all = await this.#try(() => api.listSaved(kind));
    if (!all) return;
    this.lists[kind].replaceChildren(
      ...all.map(({ name, title = name }) =>
        element(
          "li",
          {},
          element(
            "button",
            {
              type: "button",
              class: "open",
              title,
              onclick: () => this.#try(async () => this.acts.open(kind, await api.fetchSaved(kind, name), title)),
            },
            title,
          ),
          element(
            "button",
            {
              type: "button",
              class: "forget",
              "aria-label": `Delete ${title}`,
              onclick: () =>
                this.#try(async () => {
                  if (!(await ask({ title: `Delete “${title}”?`, detail: WHOSE, yes: "Delete" }))) return;
                  await api.forget(kind, name);
                  await this.refresh(kind);
                }),
            },
            "×",
          ),
        ),
      ),
    );
    if (!all.length) this.lists[kind].replaceChildren(element("li", { class: "note" }, "Nothing saved yet"));
  }

  // --- snapshots in the browser ---

  #snapshots() {
    this.shots = element("div", { class: "snapshots" });
    return this.#group(
      "Snapshots",
      element("p", { class: "note" }, "The picture with its settings, kept in this browser."),
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

  // --- files ---

  #files() {
    const picture = (label, make, ending) =>
      button(label, async (event) => {
        const { currentTarget } = event;
        currentTarget.disabled = true;
        await this.#try(async () => {
          const { blob, header } = await make();
          saveAs(blob, `sunbox-${header.samples}.${ending}`);
        });
        currentTarget.disabled = false;
      });
    const json = (kind) =>
      button(`${inWords(kind)} as JSON`, () =>
        saveAs(jsonBlob(this.acts.document(`${kind}s`)), `sunbox-${kind}.json`),
      );
    return this.#group(
      "Download",
      element("p", { class: "note" }, "The picture as it is now; no sample is taken again."),
      element(
        "div",
        { class: "row" },
        picture("PNG", () => this.acts.png(8), "png"),
        picture("PNG, 16 bit", () => this.acts.png(16), "png"),
        picture("EXR, all layers", () => this.acts.exr(), "exr"),
        json("scene"),
        json("material"),
      ),
      element("p", { class: "note" }, "JSON comes back by Open… in the Scene tab, or by dropping it on the picture."),
    );
  }

  // --- sharing ---

  #copy(text, said) {
    return this.#try(async () => {
      await navigator.clipboard.writeText(text);
      this.acts.announce(said);
    });
  }

  #sharing() {
    const text = element("textarea", {
      class: "command",
      readonly: true,
      spellcheck: "false",
      "aria-label": "Link or command",
      hidden: true,
    });
    const show = (make, said) => async (event) => {
      const value = await this.#try(make);
      if (value === null) return;
      text.hidden = false;
      text.value = value;
      event.target.focus();
      if (navigator.clipboard) await this.#copy(value, said);
      else text.select();
    };
    return this.#group(
      "Share",
      element("p", { class: "note" }, "A link that reopens this very view; a command that makes this very picture."),
      element(
        "div",
        { class: "row" },
        button(
          "Copy link",
          show(() => this.acts.link(), "Link copied."),
          { id: "copy-link" },
        ),
        button(
          "Copy curl command",
          show(async () => this.acts.command(), "Command copied."),
          { id: "copy-curl" },
        ),
      ),
      text,
    );
  }
}
