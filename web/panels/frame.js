// The frame of the page: what the outline and the inspector take of its width.

const ROOMY = matchMedia("(min-width: 75rem)"); // where the outline has room beside the picture
const BESIDE = matchMedia("(min-aspect-ratio: 1/1) and (min-width: 56.01rem)"); // where it lies over nothing
const LEAST = 360; // CSS pixels of the inspector
const MOST = 520;
const WIDE = 0.32; // of a wide window, what the inspector may have
const STEP = 16;

const most = () => Math.max(MOST, Math.round(WIDE * innerWidth));

export class Frame {
  // `find(id)` elements, `ui` the interface's state.
  constructor(find, ui) {
    Object.assign(this, { find, ui });
    find("toggle-outline").addEventListener("click", () => ui.set({ outline: !this.isOutlineShown }));
    // Where it lies over the rest, what is chosen in it takes its place; not while several are, or a thing is renamed,
    // hidden, locked or unfolded.
    find("outline-list").addEventListener("click", (event) => {
      const goesOn = event.ctrlKey || event.metaKey || event.shiftKey || event.target.closest("button, input");
      if (!BESIDE.matches && !goesOn) ui.set({ outline: false });
    });
    ROOMY.addEventListener("change", () => ui.set({ outline: null }));
    const splitter = find("splitter");
    const width = () => find("panel").getBoundingClientRect().width;
    const resize = (to) => ui.set({ inspector: Math.round(Math.min(most(), Math.max(LEAST, to))) });
    splitter.setAttribute("aria-valuemin", String(LEAST));
    splitter.setAttribute("aria-valuemax", String(most()));
    splitter.addEventListener("pointerdown", (down) => {
      const before = width();
      splitter.setPointerCapture(down.pointerId);
      splitter.onpointermove = (event) => resize(before + down.clientX - event.clientX);
      splitter.onpointerup = () => {
        splitter.onpointermove = null;
      };
    });
    splitter.addEventListener("dblclick", () => ui.set({ inspector: null }));
    splitter.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: STEP, ArrowRight: -STEP }[event.key];
      if (!step) return;
      event.preventDefault();
      event.stopPropagation();
      resize(width() + step);
    });
    new ResizeObserver(() => splitter.setAttribute("aria-valuenow", String(Math.round(width())))).observe(
      find("panel"),
    );
  }

  get isOutlineShown() {
    return this.ui.state.outline ?? ROOMY.matches;
  }

  show() {
    const { inspector } = this.ui.state;
    const { style, dataset } = document.body;
    dataset.outline = this.isOutlineShown ? "shown" : "folded";
    this.find("toggle-outline").setAttribute("aria-expanded", String(this.isOutlineShown));
    if (inspector) style.setProperty("--inspector", `${inspector}px`);
    else style.removeProperty("--inspector");
  }
}
