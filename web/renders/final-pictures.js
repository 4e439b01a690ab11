// Final pictures: what is to be rendered, the renders that the server has, and what becomes of them.

import { visible } from "../document/outline.js";
import { renderScene } from "../server/api.js";
import { RenderFiles } from "./files.js";
import { RenderList } from "./list.js";
import { RenderPictures } from "./pictures.js";
import { Renders } from "./renders.js";
import { RenderSheet } from "./sheet.js";
import { openRender } from "./viewer.js";
import { RenderViews } from "./views.js";
import { titleOf } from "./words.js";

const FURTHER = ["png-16", "exr-mattes", "webp", "avif"]; // formats beside PNG and EXR, which have buttons of their own
const SPECIAL = ["avif"]; // of these the ones that not every server writes
const LONGEST_LABEL = 200;

// `title()` of the scene in words; `recipes` as pictureRecipes has them; `compareWith(render)` shows a render beside the
// picture on the page, or is null.
export class FinalPictures {
  #isListed = false;

  constructor({ find, schema, page, editor, ui, messages, recipes, title, compareWith, complain, say }) {
    Object.assign(this, { page, editor, ui, messages, recipes, title, complain, say });
    this.views = new RenderViews();
    const view = (render) => this.views.of(render?.id) ?? page.view;
    this.renders = new Renders({
      changed: () => this.#show(),
      ended: (render) => this.#ended(render),
      forgotten: (ids) => {
        this.pictures.forget(ids);
        this.views.forget(ids);
        messages.hide("deleted"); // it cannot be taken back any more
      },
    });
    this.pictures = new RenderPictures({ view });
    this.files = new RenderFiles({ view, changed: () => this.#show(), complain, say });
    const formats = () => {
      const written = page.info?.formats?.pictures ?? [];
      return FURTHER.filter((format) => !SPECIAL.includes(format) || written.includes(format));
    };
    this.acts = {
      formats,
      view,
      compareWith,
      open: (render) => openRender(render, this.acts),
      save: (render, format) => this.files.save(render, format),
      stop: (render) => this.#try(() => this.renders.stop(render.id)),
      remove: (render) => this.#remove(render),
      reopen: (render) => this.#try(() => this.#reopen(render)),
      more: () => this.#try(() => this.renders.more()),
      left: (render) => this.renders.left(render),
      making: (id) => this.files.words(id),
      isMaking: (id, format) => this.files.isMaking(id, format),
      paint: (image, render) => this.pictures.show(image, render),
    };
    this.lists = [find("renders-sheet"), find("renders-drawer")].map((root) => new RenderList(root, this.acts));
    this.sheet = new RenderSheet(find("output"), {
      schema,
      acts: editor,
      head: find("render"),
      headSize: find("render-size"),
      start: (size) => this.#start(size),
      complain,
    });
    ui.subscribe(() => queueMicrotask(() => this.#list())); // once the others have shown what there is to see
  }

  // Call when the settings, the picture's size or what it costs may be others.
  show() {
    const { settings } = this.editor.state;
    const { quality: presets, limits } = this.page.info;
    const screen = this.page.windowSize;
    this.sheet.show(settings, { screen, presets, limits, live: this.page.header });
    this.#list();
  }

  // Puts the hand on the button of the sheet.
  focus() {
    this.sheet.button.focus();
  }

  // Renders what the button in the header says, and shows how far it is.
  render() {
    this.ui.set({ tab: "render" });
    return this.sheet.render();
  }

  async #try(work) {
    try {
      return await work();
    } catch (problem) {
      this.complain(problem);
      return null;
    }
  }

  // Asks for the list once it is to be seen.
  async #list() {
    if (this.#isListed || !this.page.isConnected || !this.lists.some(({ isShown }) => isShown)) return;
    this.#isListed = true;
    await this.#try(async () => {
      await this.views.load();
      await this.renders.refresh();
      if (!this.renders.hasMore) await this.pictures.keepOnly(this.renders.entries.map(({ id }) => id));
    });
  }

  async #start(size) {
    const { scene, settings, chosen } = this.editor.state;
    const label = this.title().slice(0, LONGEST_LABEL);
    const { view } = this.page;
    const order = { scene: visible(scene, chosen.hidden), settings: { ...settings, ...size }, label };
    await this.renders.submit(order, ({ id }) => this.views.keep(id, view));
    this.say("The render waits for its turn");
  }

  #show() {
    for (const list of this.lists) list.show(this.renders);
  }

  #ended(render) {
    // The layers of its EXR are traced now, so that they are there when somebody wants them.
    if (render.state === "done") this.files.prepare(render, "exr");
    const text = { done: "is rendered", cancelled: "is stopped", failed: "could not be rendered" }[render.state];
    if (this.lists.some(({ isShown }) => isShown)) this.say(`${titleOf(render)} ${text}`);
    else {
      const action = { label: "Open", does: () => this.acts.open(render) };
      this.messages.show("render", { title: `“${titleOf(render)}” ${text}.`, action });
    }
  }

  #remove(render) {
    const takeBack = this.renders.remove(render);
    this.messages.show("deleted", {
      title: `“${titleOf(render)}” is deleted.`,
      action: {
        label: "Bring back",
        does: () => {
          takeBack();
          this.messages.hide("deleted");
        },
      },
    });
  }

  async #reopen(render) {
    const made = await renderScene(render.id);
    this.recipes.reopen({ ...made, view: this.acts.view(render) }, titleOf(render));
  }
}
