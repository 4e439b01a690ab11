// Parts of the page whose code is fetched when somebody wants them, or when there is time for them.

export class OnDemand {
  now = null; // the part, once it is there
  #loading = null;

  // `load()` imports the module, `make(module)` gives the part, or a promise of it. `complain(problem)` says why it
  // cannot be; `arrived(part)` is called once it is there.
  constructor(load, make, { complain, arrived = () => {} }) {
    Object.assign(this, { load, make, complain, arrived });
  }

  // The part, as soon as it is there. Where it could not be loaded, the next call is another try.
  get() {
    this.#loading ??= this.load().then(
      async (module) => {
        this.now = await this.make(module);
        this.arrived(this.now);
        return this.now;
      },
      () => {
        this.#loading = null;
        throw new Error("This part of the page could not be loaded. Try again when the server answers.");
      },
    );
    return this.#loading;
  }

  // A function that calls a method of the part.
  calls(name) {
    return (...given) => this.get().then((part) => part[name](...given), this.complain);
  }

  // It is loaded as a hand comes near a button, or a part of the page. What goes wrong is said when that is pressed.
  nears(button) {
    for (const near of ["pointerenter", "focusin"]) button.addEventListener(near, () => this.get().catch(() => {}));
  }

  // What opens only with the part's own content waits for it.
  opens(popover) {
    popover.addEventListener("beforetoggle", (event) => {
      if (this.now || event.newState !== "open") return;
      event.preventDefault();
      this.get().then(() => popover.showPopover(), this.complain);
    });
  }

  // A press of a button that the part watches is repeated once it does.
  answers(button) {
    button.addEventListener("click", () => {
      if (!this.now) this.get().then(() => button.click(), this.complain);
    });
  }
}

// Has the page use one of its style sheets that stand by, which keeps its place among the others.
export function useSheet(name) {
  const link = document.querySelector(`link[href="${name}"]`);
  if (!link.disabled) return Promise.resolve();
  return new Promise((resolve) => {
    for (const kind of ["load", "error"]) link.addEventListener(kind, resolve, { once: true });
    link.disabled = false;
  });
}
