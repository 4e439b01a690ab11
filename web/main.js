// Wires the rest. State flows one way: control -> store -> stream -> frame -> viewport.

import { Adder } from "./adding.js";
import { boot } from "./boot.js";
import { commands } from "./commands.js";
import { Comparison } from "./compare.js";
import { UiState } from "./ui-state.js";
import { element } from "./dom.js";
import { Editor } from "./editor.js";
import * as exporting from "./export.js";
import { saveAs } from "./files.js";
import { Importer, watchDrops } from "./importer.js";
import { SavePage } from "./save-page.js";
import { askForKey } from "./key.js";
import { fillSheet, watchKeys } from "./keys.js";
import { Announcer, Messages } from "./messages.js";
import { Output, contained, forecastSize } from "./output.js";
import { DISPLAY, Panel } from "./panel.js";
import { defaults, materialModels } from "./schema.js";
import { essence, linkTo, revived } from "./share.js";
import { pictureRecipes } from "./picture-recipe.js";
import { Preparing } from "./preparing.js";
import { detailWords, fieldTitles, problemText } from "./problem-text.js";
import { ViewportController, viewOf } from "./viewport-controller.js";
import { Status } from "./status.js";
import { Stream } from "./stream.js";
import { watchTabs } from "./tabs.js";
import { textureActs } from "./texture-slot.js";
import { TextureThumbnails } from "./texture-thumbnails.js";
import { Thumbnails } from "./thumbnails.js";
import { Viewport, pictureSize } from "./viewport.js";
import { inWords, sentence } from "./format-text.js";
import { forgetWork, keepWork } from "./work.js";

const RESIZE_REST_MS = 120; // a window being dragged restarts nothing
const KEEP_REST_MS = 600;

// Pixels that a renderer can keep up with under the hand.
const AREA = { software: 512 * 512, hardware: 1920 * 1080 };

// A picture that somebody stopped to look at; else the server chooses (null), by whether it is still changing.
const PAUSED_QUALITY = 90;

const find = (id) => document.getElementById(id);
const root = find("stage");
// A refusal goes with the next change of the picture, what was said of a file with its scene, a greeting at once.
const ABOUT = { refusal: ({ scene, settings, compare }) => [scene, settings, compare], work: ({ scene, settings }) => [scene, settings] };
const messages = new Messages(find("messages"), (kind) => (ABOUT[kind] ?? (({ home }) => [home]))(editor?.state ?? {}));
const announcer = new Announcer(find("announcer"));
const status = new Status(document);
const ui = new UiState();

let titles = {};
const complain = (problem) => { messages.show("refusal", { title: problemText(problem, titles) }); };

let editor = null;
const { schema, library, calls, name, scene, left } = await boot({
  keyDialog: find("key-dialog"), complain,
  told(problem) {
    if (!problem) return messages.hide("connection");
    status.state("Offline");
    messages.show("connection", { title: "The server does not answer.", detail: "Trying again…", lasting: true });
  },
});
titles = fieldTitles(schema.scene, schema.settings, schema.view);
editor = new Editor({ schema, name, scene, complain, forgive: () => messages.hide("refusal") });
if (left) editor.amend(left.state);

const displayDefaults = defaults(schema.view, schema.view, DISPLAY);
const layers = schema.view.properties.aov.enum;

const recipes = pictureRecipes({
  schema, acts: editor, info: () => info, size: () => size(), view: () => shownView(), viewDefaults: displayDefaults,
});

let info = null;
let isPaused = false;
let isConnected = false;
let isWaiting = false;
let ended = null; // the generation that is done
let painted = 0; // the generation on the canvas
let shownHome = null; // the scene on the canvas, as it was picked
let header = null; // of the frame on the canvas
let knobs = {}; // what the chosen quality makes of the settings that are not given

const names = (layer, { shapes, materials }) => (layer === "shape_id"
  ? shapes.map(({ type, material }, i) => `${i + 1} ${inWords(type)}, ${inWords(material)}`)
  : Object.keys(materials).map(inWords));

const viewport = new Viewport(find("picture"), {
  names: (aov) => names(aov, stream.document),
  painted(frame) {
    ({ header } = frame);
    root.classList.add("live");
    painted = header.generation;
    preparing.end();
    if (!isWaiting) shownHome = editor.state.home;
    status.frame(header, limit());
    controller.painted(frame);
    comparison.painted();
    if (ui.state.tab === "render") showPrices();
    tellState();
  },
});

const stream = new Stream({
  hello(hello, isTakenUp) {
    info = hello;
    isConnected = true;
    messages.hide("connection");
    messages.hide("refusal");
    find("renderer").textContent = info.renderer?.renderer ?? "";
    viewport.restart();
    if (!isTakenUp) controller.picker.forget();
    refresh();
  },
  frame: (frame, bytes, view, acknowledge) => viewport.show(frame, bytes, view, acknowledge),
  waiting(is) {
    isWaiting = is;
    if (is) controller.inspector.forget();
    preparing.wait(is);
    tellState();
  },
  done({ generation }) {
    ended = generation;
    tellState();
    announcer.say("The picture is done");
    thumbnails.work();
  },
  refused(problem, valid) {
    const places = editor.takeBack(problem, valid, (pointer, detail) => panel.mark(pointer, sentence(detailWords(detail))));
    // Said once: at the control, where that can be seen.
    preparing.end();
    if (!places.length || places.includes(null) || !panel.isMarkSeen) complain(problem);
    else announcer.say(problemText(problem, titles));
  },
  lost,
});

const preparing = new Preparing({
  stage: root, label: find("preparing"), begun: () => { status.blank(); tellState(); },
  subject() {
    const { home, chosen } = editor.state;
    const isOther = home !== shownHome;
    const title = library.scenes.find(({ name: each }) => each === chosen.scene)?.title ?? chosen.scene;
    return { isOther, name: isOther ? title || "the scene" : "the change" };
  },
});

function lost({ title, detail = "", key }, wait_ms) {
  isConnected = false;
  preparing.end();
  tellState();
  if (key) {
    askForKey(find("key-dialog"), sessionStorage.getItem("sunbox.key") !== null).then(() => stream.retry());
    return;
  }
  messages.show("connection", {
    title, detail: [detail, wait_ms === null ? "" : "Trying to reconnect…"].filter(Boolean).join(" "),
    action: { label: wait_ms === null ? "Try again" : "Try now", does: () => stream.retry() }, lasting: true,
  });
}

const controller = new ViewportController({
  find, acts: editor, ui, stream, viewport, complain, say: (text) => announcer.say(text),
});
const thumbnails = new Thumbnails(() => isConnected && ended === painted && !isPaused);
const textureThumbnails = new TextureThumbnails();
const adder = new Adder({ acts: editor, controller });
const importer = new Importer({ schema, acts: editor, adder, messages, controller, reopen: recipes.reopen, thumbnails: textureThumbnails });
editor.takeTexture = (place, file) => importer.texture(place, file);
editor.frame = (thing) => controller.frame(thing);
editor.addThing = (offer) => adder.add(offer);
editor.duplicate = (thing) => adder.duplicate(thing);
const panel = new Panel(find("panel"), {
  schema, library, acts: editor, paint: (image, preset, fetch) => thumbnails.preset(image, preset, fetch), say: (text) => announcer.say(text),
  textureActs: textureActs({ editor, importer, thumbnails: textureThumbnails }),
});
const comparison = new Comparison(
  { root: find("comparison"), stage: root, divider: find("divider"), canvas: find("picture-b"), difference: find("difference") },
  { first: viewport, acts: editor, models: Object.keys(materialModels(schema.scene)), changed: refresh, names, lost: () => {}, beside: () => stream.session, headerOfA: () => header },
);

const savePage = new SavePage(find("page-save"), {
  hasDocuments: Object.keys(calls).some((path) => path.startsWith("/v1/documents")),
  acts: {
    document: (kind) => (kind === "scenes" ? editor.state.scene : editor.material),
    open: (kind, document, title) => (kind === "scenes" ? editor.openScene(document, title) : editor.putMaterial(document)),
    state: () => essence(editor.state),
    restore: (kept) => editor.change(revived(kept)),
    async snapshot() {
      const { bytes, header: taken } = await stream.capture({ format: "jpeg", quality: 85, aov: "color" });
      return { blob: new Blob([bytes], { type: taken.mime }), note: `${taken.samples} samples` };
    },
    link: () => linkTo(editor.state),
    command: () => exporting.curl(editor.state.scene, exporting.exactSettings({ ...editor.state.settings, ...size() }, header?.samples ?? 1), shownView()),
    png: (bits) => exporting.png(stream, bits, recipes.madeFrom),
    exr: () => exporting.exr(stream, layers, recipes.madeFrom),
    complain, announce: (text) => announcer.say(text),
  },
});

const limit = () => editor.state.settings.max_samples ?? knobs.max_samples ?? null;
const shownView = () => ({ ...displayDefaults, ...editor.state.view });

const output = new Output(find("output"), {
  schema, acts: editor, order: () => ({ scene: editor.state.scene, settings: editor.state.settings }), view: shownView, complain,
  say: (text) => announcer.say(text),
});

function showPrices() {
  const { settings } = editor.state;
  panel.showQualities(info.quality, settings, header);
  output.show(settings, size(), (wanted) => forecastSize(wanted, limit(), header));
}

// Transparency shows where the scene asks for it, or the person does.
const isCheckered = () => ui.state.checker ?? editor.state.scene.environment?.background === false;

function size() {
  const area = Math.min(info.renderer?.software === false ? AREA.hardware : AREA.software, info.limits.max_pixels);
  const { width, height } = editor.state.settings;
  const stageBox = root.getBoundingClientRect();
  const box = width && height ? contained(stageBox, { width, height }) : stageBox;
  if (!editor.sceneB) return pictureSize(box, window.devicePixelRatio, area);
  return pictureSize(comparison.fit(box), window.devicePixelRatio, area / 2); // two variants share what one may cost
}

function tellState() {
  root.setAttribute("aria-busy", String(!stream.isNewest(painted)));
  const busy = preparing.isShown || !header ? "Preparing" : "Rendering";
  status.state(!isConnected ? "Offline" : isPaused ? "Paused" : ended === painted && !isWaiting ? "Done" : busy);
}

// Tells the streams what is wanted, and the page how things stand.
function push() {
  if (!info) return;
  const { scene: document, settings } = editor.state;
  const second = editor.sceneB;
  const view = viewOf({ ...ui.state, checkered: isCheckered() }, shownView(), {
    isPaused, quality: PAUSED_QUALITY, isExact: second !== null,
  });
  comparison.show(second && { scene: second, settings: { ...settings, ...size() }, view }, isPaused);
  stream.show({ scene: document, settings: { ...settings, ...size() }, view });
  root.classList.toggle("checker", isCheckered());
  find("compare").setAttribute("aria-pressed", String(second !== null));
  tellState();
}

let keeping = 0;
function refresh() {
  const { quality = schema.settings.properties.quality.default, time_limit, target_noise } = editor.state.settings;
  const preset = info?.quality[quality] ?? {};
  knobs = time_limit || target_noise ? { ...preset, max_samples: null } : preset;
  panel.show(editor.state, knobs);
  if (info) showPrices();
  find("undo").disabled = !editor.canUndo;
  find("redo").disabled = !editor.canRedo;
  find("paste-material").disabled = clip === null && !navigator.clipboard?.readText;
  push();
  messages.review();
  controller.mark();
  clearTimeout(keeping);
  if (editor.canUndo || left) keeping = setTimeout(() => keepWork(essence(editor.state)), KEEP_REST_MS);
}

// --- what buttons and keys do ---

function togglePause() {
  isPaused = !isPaused;
  if (isPaused) stream.pause();
  else stream.resume();
  const button = find("pause");
  button.classList.toggle("paused", isPaused);
  button.querySelector("span").textContent = isPaused ? "Resume" : "Pause";
  push();
}

async function download() {
  const button = find("download");
  button.disabled = true;
  try {
    const { blob, header: taken } = await exporting.png(stream, 8, recipes.madeFrom);
    saveAs(blob, `sunbox-${editor.state.chosen.scene || "scene"}-${taken.samples}.png`);
  } catch (error) {
    complain(error);
  }
  button.disabled = false;
}

function travel(step) {
  panel.forgive();
  editor.forgive();
  step();
}

// The browser's clipboard where it lets us, else one of our own.
let clip = null;

function copyMaterial() {
  clip = editor.material;
  navigator.clipboard?.writeText(JSON.stringify(clip, null, 2)).catch(() => {});
  announcer.say("Material copied");
  refresh();
}

async function pasteMaterial() {
  try {
    const text = await navigator.clipboard?.readText().catch(() => null);
    if (text?.trim().startsWith("{")) importer.openDocument(JSON.parse(text), "pasted");
    else if (clip) editor.putMaterial(clip);
  } catch (error) {
    complain(error);
  }
}

const toggle = (member) => ui.set({ [member]: !ui.state[member] });
const toggleCompare = () => (editor.state.compare ? editor.stopComparing() : editor.startComparing());
const toggleChecker = () => ui.set({ checker: !isCheckered() });
const showKeys = () => find("keys-dialog").showModal();
const reset = () => editor.putMaterial({ type: editor.material.type });

const does = {
  toggle, toggleCompare, toggleChecker, togglePause, copyMaterial, pasteMaterial, download, showKeys,
  undo: () => travel(() => editor.undo()), redo: () => travel(() => editor.redo()),
  remove: () => { if (editor.removable(editor.state.chosen.thing)) editor.remove(editor.state.chosen.thing); },
  openFiles: () => importer.browse("open"), snapshot: () => savePage.snapshot(), pickTool: (tool) => ui.set({ tool }),
  frame: () => controller.frame(), resetView: () => editor.resetView(),
  nextLayer: () => ui.set({ layer: layers[(layers.indexOf(ui.state.layer) + 1) % layers.length] }),
};
const acts = commands(does);
watchKeys(controller.keyMove, acts);
fillSheet(find("keys"), acts);

const clicks = {
  pause: does.togglePause, download, compare: toggleCompare, help: showKeys, undo: does.undo, redo: does.redo, frame: does.frame,
  "reset-view": does.resetView, "open-file": does.openFiles, "add-file": () => importer.browse("add"),
  "copy-material": copyMaterial, "paste-material": pasteMaterial, "reset-material": reset,
  theme: () => ui.set({ theme: getComputedStyle(document.documentElement).colorScheme === "light" ? "dark" : "light" }),
};
for (const [id, does] of Object.entries(clicks)) find(id).addEventListener("click", does);

watchDrops(document, {
  take: (files, at) => importer.take(files, { at }),
  tell(text) {
    find("drop").hidden = text === null;
    find("drop-hint").textContent = text ?? "";
  },
});

// --- the interface ---

const showTab = watchTabs(find("tabs"), ui.state.tab, (tab) => ui.set({ tab }));
const layer = find("layer");
layer.append(...layers.map((each) => element("option", { value: each }, inWords(each))));
layer.addEventListener("change", () => ui.set({ layer: layer.value }));
const checks = { histogram: "Histogram", clipping: "Clipped pixels", checker: "Checker behind alpha", guides: "Guides" };
find("overlays").append(...Object.entries(checks).map(([member, title]) => element("label", {},
  element("input", {
    type: "checkbox", class: "toggle", id: `show-${member}`,
    onchange: () => (member === "checker" ? toggleChecker() : toggle(member)),
  }), title)));

function showUi() {
  const { tab, theme } = ui.state;
  showTab(tab);
  layer.value = ui.state.layer;
  for (const member of Object.keys(checks)) find(`show-${member}`).checked = member === "checker" ? isCheckered() : ui.state[member];
  if (theme) document.documentElement.dataset.theme = theme;
  controller.showUi(ui.state);
  push();
}

ui.subscribe(showUi);
editor.subscribe(refresh);

let resizing = 0;
new ResizeObserver(() => {
  clearTimeout(resizing);
  resizing = setTimeout(() => { push(); controller.overlay(); controller.mark(); }, RESIZE_REST_MS);
}).observe(root);

if (left?.from === "work") {
  messages.show("work", {
    title: "Your last work is back.",
    action: { label: "Start afresh", does: () => { forgetWork(); messages.hide("work"); editor.openScene(scene, name); } },
  });
}
showUi();
refresh();
stream.connect();
