// The lobe's panel, whose code is fetched when the panel is opened, or as a hand comes near its button.

export class LobeOnDemand {
  #panel = null;
  #loading = null;

  // `root` and `needs` are what LobePanel is made of; `complain(problem)` says why it cannot be.
  constructor(root, { complain, ...needs }) {
    Object.assign(this, { root, needs, complain });
  }

  #load() {
    this.#loading ??= import("./panel.js").then(
      ({ LobePanel }) => {
        this.#panel = new LobePanel(this.root, this.needs);
      },
      () => {
        this.#loading = null; // the next time it is asked for, it is tried again
        throw new Error("The lobe's panel could not be loaded. Open it again when the server answers.");
      },
    );
    return this.#loading;
  }

  // Before the panel opens: its code comes, and the kernel of its first plot is compiled.
  prepare() {
    this.#load().then(
      () => this.#panel.prepare(),
      () => {}, // said when it is opened
    );
  }

  refresh() {
    if (this.#panel) this.#panel.refresh();
    else if (!this.root.hidden) this.#load().then(() => this.#panel.refresh(), this.complain);
  }
}
