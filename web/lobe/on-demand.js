// The lobe's panel, whose code is fetched when the panel is opened, or as a hand comes near its button.

import { OnDemand, useSheet } from "../lib/on-demand.js";

export class LobeOnDemand {
  #part;

  // `root` and `needs` are what LobePanel is made of; `complain(problem)` says why it cannot be.
  constructor(root, { complain, ...needs }) {
    this.root = root;
    const load = async () => {
      const [module] = await Promise.all([import("./panel.js"), useSheet("lobe.css")]);
      return module;
    };
    this.#part = new OnDemand(load, ({ LobePanel }) => new LobePanel(root, needs), { complain });
  }

  // Before the panel opens its code comes, and nothing is asked of the renderer.
  prepare() {
    this.#part.get().catch(() => {}); // said when it is opened
  }

  refresh() {
    if (this.#part.now) this.#part.now.refresh();
    else if (!this.root.hidden) this.#part.calls("refresh")();
  }
}
