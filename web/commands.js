// The commands of the buttons and the keys: what each one does, and which keys give it.

import { OnDemand } from "./lib/on-demand.js";
import { whyItStays } from "./document/outline.js";
import { compared } from "./document/variants.js";

// The copied material: the browser's clipboard where the page may read it, else one of the page's own.
class Clipboard {
  #own = null;

  get isEmpty() {
    return this.#own === null && !navigator.clipboard?.readText;
  }

  write(material) {
    this.#own = material;
    navigator.clipboard?.writeText(JSON.stringify(material, null, 2)).catch(() => {});
  }

  // {pasted}: a JSON document from outside, else {own}: the material that was copied here or null.
  async read() {
    const text = await navigator.clipboard?.readText().catch(() => null);
    return text?.trim().startsWith("{") ? { pasted: JSON.parse(text) } : { own: this.#own };
  }
}

// {does, canPaste}: the commands by name. `find(id)` elements; `page` is the PageState; `later` has the parts on demand; `complain(error)`, `say(text)`; `refresh()` shows what has changed, `push()` tells the streams.
export function makeCommands({
  find,
  page,
  editor,
  ui,
  stream,
  controller,
  panel,
  later,
  complain,
  say,
  refresh,
  push,
}) {
  const clipboard = new Clipboard();
  const { importer, menus, finals } = later;
  const keySheet = new OnDemand(
    () => import("./keys-sheet.js"),
    ({ fillSheet }) => fillSheet(find("keys"), keyTable(does)),
    { complain },
  );

  // Words about what was refused belong to a state that is left.
  const travel = (step) => {
    panel.forgive();
    editor.forgive();
    step();
  };

  const does = {
    toggle: (member) => ui.set({ [member]: !ui.state[member] }),
    toggleChecker: () => ui.set({ checker: !page.isCheckered }),
    toggleCompare: () => (compared(editor.state) ? editor.stopComparing() : editor.startComparing()),
    togglePause() {
      page.isPaused = !page.isPaused;
      if (page.isPaused) stream.pause();
      else stream.resume();
      const button = find("pause");
      button.classList.toggle("paused", page.isPaused);
      button.setAttribute("aria-label", page.isPaused ? "Resume" : "Pause");
      push();
    },
    toggleTheme: () =>
      ui.set({ theme: getComputedStyle(document.documentElement).colorScheme === "light" ? "dark" : "light" }),
    toggleLobe: () => {
      if (!find("show-lobe").hidden) ui.set({ lobe: !ui.state.lobe });
    },
    pickTool: (tool) => ui.set({ tool }),
    nextLayer: () => ui.set({ layer: page.layers[(page.layers.indexOf(ui.state.layer) + 1) % page.layers.length] }),
    undo: () => travel(() => editor.undo()),
    redo: () => travel(() => editor.redo()),
    remove: () => {
      const { thing } = editor.state.chosen;
      if (editor.removable(thing)) editor.remove(thing);
      else complain(new Error(whyItStays(thing)));
    },
    land: async () => (await controller.tools.get()).handles.land(),
    copyMaterial() {
      clipboard.write(editor.materialSet);
      say("Material copied");
      refresh();
    },
    async pasteMaterial() {
      try {
        const { pasted, own } = await clipboard.read();
        if (pasted) (await importer.get()).openDocument(pasted, "pasted");
        else if (own) editor.putMaterial(own);
      } catch (error) {
        complain(error);
      }
    },
    resetMaterial: () => editor.putMaterial({ type: editor.material.type }),
    openFiles: () => importer.calls("browse")("open"),
    addFiles: () => importer.calls("browse")("add"),
    snapshot: () => menus.get().then(({ sceneMenu }) => sceneMenu.snapshot(), complain),
    frame: () => controller.frame(),
    resetView: () => editor.resetView(),
    showKeys: () => keySheet.get().then(() => find("keys-dialog").showModal(), complain),
    toggleOutline: () => find("toggle-outline").click(),
    renderPicture: finals.calls("render"),
    // The first press shows the frame and the price, the next one renders; a double click is the first press alone.
    pressRender({ detail }) {
      const isShown = ui.state.tab === "render";
      if (isShown && detail < 2) return does.renderPicture();
      if (!isShown) ui.set({ tab: "render" });
      return finals.calls("focus")();
    },
    download: () => menus.get().then(({ exportMenu }) => exportMenu.png(), complain),
  };
  return {
    does,
    get canPaste() {
      return !clipboard.isEmpty;
    },
  };
}

// The command of each button, by the button's id.
const BUTTONS = {
  pause: "togglePause",
  render: "pressRender",
  compare: "toggleCompare",
  help: "showKeys",
  undo: "undo",
  redo: "redo",
  frame: "frame",
  "reset-view": "resetView",
  theme: "toggleTheme",
  "copy-material": "copyMaterial",
  "paste-material": "pasteMaterial",
  "reset-material": "resetMaterial",
  "show-lobe": "toggleLobe",
};

export function watchButtons(find, does) {
  for (const [id, name] of Object.entries(BUTTONS)) find(id).addEventListener("click", (event) => does[name](event));
}

const TOOLS = {
  orbit: "orbit and select",
  move: "move the selection; arrows and Page up, Page down",
  rotate: "rotate the selection; arrows",
  scale: "scale the selection; arrows",
  fly: "look around",
  focus: "focus by clicking",
  inspect: "zoom in to the pixels; arrows move the cross",
  highlight: "click where the highlight of the chosen light, or the environment, should be",
};

// The keys of the commands and the words of the sheet that explains them: [{keys, shift, ctrl, does, says, group}].
export function keyTable(does) {
  const { toggle, pickTool } = does;
  return [
    { keys: ["z"], ctrl: true, shift: false, does: does.undo, says: "undo, also the camera", group: "Work" },
    { keys: ["z"], ctrl: true, shift: true, does: does.redo, says: "redo", group: "Work" },
    { keys: ["y"], ctrl: true, does: does.redo, says: "redo", group: "Work" },
    { keys: ["c"], ctrl: true, notInText: true, does: does.copyMaterial, says: "copy the material", group: "Work" },
    {
      keys: ["v"],
      ctrl: true,
      notInText: true,
      does: does.pasteMaterial,
      says: "paste a material or a scene",
      group: "Work",
    },
    { keys: ["delete"], does: does.remove, says: "delete the selected thing", group: "Work" },
    {
      keys: ["end"],
      does: does.land,
      says: "set the selection down on the ground",
      group: "Tools",
    },
    { keys: ["o"], ctrl: true, does: does.openFiles, says: "open a model or a scene", group: "Work" },
    { keys: ["enter"], ctrl: true, does: does.renderPicture, says: "render the final picture", group: "Work" },
    { keys: [" "], does: does.togglePause, says: "pause, resume", group: "Work" },
    { keys: ["p"], does: does.download, says: "the picture as a PNG", group: "Work" },
    { keys: ["n"], does: does.snapshot, says: "take a snapshot", group: "Work" },
    ...Object.entries(TOOLS).map(([tool, says], i) => ({
      keys: [String(i + 1)],
      does: () => pickTool(tool),
      says,
      group: "Tools",
    })),
    { keys: ["t"], does: does.toggleOutline, says: "show or fold the outline", group: "View" },
    { keys: ["f"], does: does.frame, says: "frame the selection", group: "View" },
    { keys: ["home"], does: does.resetView, says: "back to the first view", group: "View" },
    { keys: ["escape"], does: () => pickTool("orbit"), says: "put the tool away", group: "Tools" },
    { keys: ["c"], does: does.toggleCompare, says: "compare two variants", group: "View" },
    { keys: ["b"], does: does.toggleLobe, says: "how the material scatters light", group: "View" },
    { keys: ["l"], does: does.nextLayer, says: "next layer", group: "View" },
    { keys: ["h"], does: () => toggle("histogram"), says: "histogram", group: "View" },
    { keys: ["x"], does: () => toggle("clipping"), says: "clipped pixels", group: "View" },
    { keys: ["k"], does: does.toggleChecker, says: "checker behind transparency", group: "View" },
    { keys: ["g"], does: () => toggle("guides"), says: "guides: action and title safe, thirds", group: "View" },
    { keys: ["?"], does: does.showKeys, says: "this sheet", group: "Work" },
  ];
}
