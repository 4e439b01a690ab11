// The state of the interface, as opposed to the document: the active tool, the overlays of the picture, the open tab.
// It is neither undone nor shared; how the page is laid out outlives it.

const STORED = "sunbox.ui";
export const HANDLED = ["move", "rotate", "scale"]; // the tools that put handles on the selection
const LASTING = ["denoised", "drawer", "theme", "lobe", "outline", "inspector", "hint"];

export class UiState {
  #listeners = [];
  state = {
    tool: "orbit",
    layer: "color",
    denoised: true, // what is seen while it is noisy; what is saved is as the settings say
    histogram: false,
    clipping: false,
    checker: null,
    guides: false,
    target: false,
    tab: "properties",
    drawer: "materials",
    theme: null,
    lobe: false,
    outline: null, // shown or folded; null: as there is room
    hint: true, // that files can be dropped: until one was, or nobody wants to read it any more
    inspector: null, // its width in CSS pixels; null: as there is room
  };

  constructor() {
    try {
      const stored = JSON.parse(localStorage.getItem(STORED) ?? "{}");
      for (const name of LASTING) if (stored[name] !== undefined) this.state[name] = stored[name];
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
