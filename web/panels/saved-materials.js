// Materials that users have saved on the server.

import * as api from "../server/api.js";

export const WHOSE = "Everybody who uses this server sees it there, and this cannot be undone.";

export class SavedMaterials {
  entries = []; // {name, title}

  // `acts` the editor, `changed(name)` is called when there are others or the one of that name is another, `say(text)` reads out.
  constructor({ acts, changed, say }) {
    Object.assign(this, { acts, changed, say });
    this.refresh();
  }

  async #try(work) {
    try {
      return await work();
    } catch (problem) {
      this.acts.complain(problem);
      return null;
    }
  }

  // `saved`: the title of one that is new or another.
  refresh(saved = null) {
    return this.#try(async () => {
      this.entries = (await api.listSaved("materials")).map(({ name, title = name }) => ({ name, title }));
      this.changed(this.entries.find(({ title }) => title === saved)?.name);
    });
  }

  fetch(name) {
    return api.fetchSaved("materials", name);
  }

  // Asks for a name, and saves the material in hand.
  save() {
    return this.#try(async () => {
      const { ask, askName } = await import("../lib/ask.js");
      const { materialSet, state } = this.acts;
      const wanted = await askName({
        title: "Save to Mine",
        label: "Name",
        value: state.chosen.material,
        action: "Save",
        problem: (name) => (name ? null : "A material needs a name."),
      });
      if (wanted === null) return;
      const isTaken = this.entries.some(({ title }) => title === wanted);
      if (isTaken && !(await ask({ title: `Replace “${wanted}”?`, detail: WHOSE, yes: "Replace" }))) return;
      await api.save("materials", wanted, materialSet);
      this.say(`Saved ${wanted}.`);
      await this.refresh(wanted);
    });
  }

  forget(name) {
    return this.#try(async () => {
      const { ask } = await import("../lib/ask.js");
      const { title } = this.entries.find((each) => each.name === name);
      if (!(await ask({ title: `Delete “${title}”?`, detail: WHOSE, yes: "Delete" }))) return;
      await api.forget("materials", name);
      await this.refresh();
    });
  }
}
