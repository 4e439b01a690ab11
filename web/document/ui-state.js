// The state of the interface, as opposed to the document: the active tool, the overlays of the picture, the open tab.
// It is neither undone nor shared; the tab, the theme and whether the lobe is shown outlive the page.

const STORED = "sunbox.ui";
const LASTING = ["tab", "theme", "lobe"];

export class UiState {
  #listeners = [];
  state = {
    tool: "orbit",
    layer: "color",
    histogram: false,
    clipping: false,
    checker: null,
    guides: false,
    tab: "material",
    theme: null,
    lobe: false,
  };

  constructor() {
    try {
      Object.assign(this.state, JSON.parse(localStorage.getItem(STORED) ?? "{}"));
    } catch {
      // There is no storage, or it holds something else: the defaults stay.
    }
  }

  subscribe(listener) {
    this.#listeners.push(listener);
  }

  set(members) {
    this.state = { ...this.state, ...members };
    try {
      localStorage.setItem(
        STORED,
        JSON.stringify(Object.fromEntries(LASTING.map((name) => [name, this.state[name]]))),
      );
    } catch {
      // Storage is full or forbidden: the state ends with the page.
    }
    for (const listener of this.#listeners) listener(this.state);
  }
}
