// How a person works, as opposed to what is worked on: the tool in the hand, what lies over the picture, the
// open tab. Not undone, not shared; the tab and the theme outlive the page.

const KEPT = "sunbox.desk";
const LASTING = ["tab", "theme"];

export class Desk {
  #listeners = [];
  state = {
    tool: "orbit", layer: "color", histogram: false, clipping: false, checker: null, guides: false, tab: "material", theme: null,
  };

  constructor() {
    try {
      Object.assign(this.state, JSON.parse(localStorage.getItem(KEPT) ?? "{}"));
    } catch {
      // No storage, or something else's: the desk begins tidy.
    }
  }

  subscribe(listener) { this.#listeners.push(listener); }

  set(members) {
    this.state = { ...this.state, ...members };
    try {
      localStorage.setItem(KEPT, JSON.stringify(Object.fromEntries(LASTING.map((name) => [name, this.state[name]]))));
    } catch {
      // Full or forbidden: only forgotten sooner.
    }
    for (const listener of this.#listeners) listener(this.state);
  }
}
