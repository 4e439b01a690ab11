// Composes the page. State flows one way: control -> editor -> stream -> frame -> viewport.

import { boot } from "./boot.js";
import { keyTable, makeCommands, watchButtons } from "./commands.js";
import { DisplayControls } from "./panels/display-controls.js";
import { changed } from "./document/changes.js";
import { Editor } from "./document/editor.js";
import { learnNames, sentence } from "./lib/format-text.js";
import { watchDrops } from "./lib/drops.js";
import { Frame } from "./panels/frame.js";
import { askForKey } from "./server/key.js";
import { watchKeys } from "./keys.js";
import { laterParts } from "./later.js";
import { LastPicture, subject } from "./panels/last-picture.js";
import { LobeOnDemand } from "./lobe/on-demand.js";
import { Announcer, Messages } from "./panels/messages.js";
import { Outliner } from "./panels/outliner.js";
import { Paced } from "./lib/paced.js";
import { entire } from "./document/outline.js";
import { PageState, namesOf } from "./document/page-state.js";
import { Panel } from "./panels/panel.js";
import { Preparing } from "./panels/preparing.js";
import { detailWords, fieldTitles, problemText } from "./server/problem-text.js";
import { offerUndo } from "./panels/replaced.js";
import { SavedMaterials } from "./panels/saved-materials.js";
import { modelNames } from "./server/schema.js";
import { essence } from "./document/share.js";
import { compared } from "./document/variants.js";
import { Shelf } from "./panels/shelf.js";
import { Status } from "./panels/status.js";
import { Stream } from "./server/stream.js";
import { textureActs } from "./forms/texture-slot.js";
import { Thumbnails } from "./forms/thumbnails.js";
import { UiState } from "./document/ui-state.js";
import { Viewport } from "./picture/viewport.js";
import { ViewportController } from "./picture/viewport-controller.js";
import { forgetWork, keepWork } from "./document/work.js";

const RESIZE_REST_MS = 120; // a window being dragged restarts nothing
const SAVE_REST_MS = 600;
const KEPT_REST_MS = 5000; // between two pictures that are kept for the next visit
const PATIENCE_MS = 3000;

const find = (id) => document.getElementById(id);
const root = find("stage");
// A refusal goes with the next change of the picture, what was said of a file with its scene, a greeting at once.
const ABOUT = {
  refusal: ({ scene, settings, compare }) => [scene, settings, compare],
  work: ({ scene, settings }) => [scene, settings],
};
const messages = new Messages(find("messages"), (kind) =>
  (ABOUT[kind] ?? (({ home }) => [home]))(editor?.state ?? {}),
);
const announcer = new Announcer(find("announcer"));
const say = (text) => announcer.say(text);
const status = new Status(document);
const ui = new UiState();

let titles = {};
const complain = (problem) => {
  messages.show("refusal", { title: problemText(problem, titles) });
};

const lastPicture = new LastPicture(find("last-picture"), root);
let editor = null;
const { schema, library, name, scene, left } = await boot({
  keyDialog: find("key-dialog"),
  complain,
  begins: (work, builtIn) =>
    lastPicture.show(subject({ ...work, hidden: work?.chosen?.hidden }, work ? null : builtIn)),
  told(problem) {
    if (!problem) return messages.hide("connection");
    status.state("Offline");
    find("preparing").hidden = true;
    messages.show("connection", { title: "The server does not answer.", detail: "Trying again…", lasting: true });
  },
});
learnNames(modelNames(schema.scene));
titles = fieldTitles(schema.scene, schema.settings, schema.view);
editor = new Editor({
  schema,
  name,
  scene,
  complain,
  forgive: () => messages.hide("refusal"),
  waits: tellState,
  askFile: (wanted) => later.importer.calls("pick")(wanted),
});
if (left) editor.amend(left.state);
const page = new PageState({ schema, editor, ui, root, fit: (box) => later.comparison.now?.fit(box) ?? box });

// The name of a scene in words.
const titleOf = ({ scene: own }) => library.scenes.find(({ name: each }) => each === own)?.title ?? own;
const sceneTitle = () => titleOf(editor.state.chosen) || "Your own scene";

// --- the picture ---

// What the first picture does not need waits for it, but not for a compiler.
let begin = () => {};
const begun = new Promise((resolve) => {
  begin = resolve;
  setTimeout(resolve, PATIENCE_MS);
});

const viewport = new Viewport(find("picture"), {
  names: (aov) => namesOf(aov, stream.document),
  painted(frame) {
    const isFirst = !page.header;
    page.paint(frame);
    preparing.painted();
    lastPicture.painted(frame.header);
    status.frame(frame.header, page.limit);
    controller.painted(frame);
    comparison.now?.painted();
    if (ui.state.tab === "render") finals.now?.show();
    tellState();
    if (isWorthKeeping()) keeping.ask();
    if (!isFirst) return;
    performance.mark("first picture");
    begin();
    later.prepare().then(() => performance.mark("all parts"));
  },
});

// Not a preview, and of what the editor has now.
function isWorthKeeping() {
  const { header, isWaiting, painted } = page;
  if (header.scale < 1 || isWaiting || !stream.isNewest(painted)) return false;
  return ui.state.layer === "color" && !compared(editor.state);
}

const keeping = new Paced(KEPT_REST_MS, () => {
  if (!isWorthKeeping()) return; // another picture is on its way, and asks again
  const { scene, chosen } = editor.state;
  const builtIn = editor.canUndo || left ? null : name;
  return lastPicture.keep(viewport.canvas, subject({ scene, hidden: chosen.hidden }, builtIn));
});

const stream = new Stream({
  hello(info, isTakenUp) {
    Object.assign(page, { info, isConnected: true });
    messages.hide("connection");
    messages.hide("refusal");
    find("renderer").textContent = info.renderer?.renderer ?? "";
    viewport.restart();
    if (!isTakenUp) controller.forget();
    refresh();
  },
  frame: (frame, bytes, view, acknowledge) => viewport.show(frame, bytes, view, acknowledge),
  waiting(isWaiting) {
    page.isWaiting = isWaiting;
    if (isWaiting) controller.awaited();
    preparing.wait(isWaiting);
    tellState();
  },
  done({ generation }) {
    page.ended = generation;
    lastPicture.end();
    tellState();
    say("The picture is done");
  },
  refused: (problem, valid) => later.mend(problem, () => takeBack(problem, valid)),
  lost({ title, detail = "", key }, wait_ms) {
    page.isConnected = false;
    preparing.end();
    tellState();
    if (key) {
      askForKey(find("key-dialog"), sessionStorage.getItem("sunbox.key") !== null).then(() => stream.retry());
      return;
    }
    messages.show("connection", {
      title,
      detail: [detail, wait_ms === null ? "" : "Trying to reconnect…"].filter(Boolean).join(" "),
      action: { label: wait_ms === null ? "Try again" : "Try now", does: () => stream.retry() },
      lasting: true,
    });
  },
});

function takeBack(problem, valid) {
  const places = editor.takeBack(problem, valid && { ...valid, scene: entire(valid.scene) }, (pointer, detail) =>
    panel.mark(pointer, sentence(detailWords(detail))),
  );
  // Said once: at the control, where that can be seen.
  preparing.end();
  if (!places.length || places.includes(null) || !panel.isMarkSeen) complain(problem);
  else say(problemText(problem, titles));
}

const preparing = new Preparing({
  label: find("preparing"),
  begun: () => {
    status.blank();
    tellState();
  },
  say,
  subject() {
    const { home, chosen } = editor.state;
    if (home !== page.paintedHome) return { isOther: true, name: titleOf(chosen) || "the scene" };
    const { scene } = page.wanted;
    return { isOther: false, name: changed(page.paintedScene, scene) };
  },
});

const controller = new ViewportController({ find, acts: editor, ui, stream, viewport, complain, say });
const later = laterParts({
  find,
  schema,
  page,
  editor,
  ui,
  stream,
  viewport,
  controller,
  messages,
  titleOf,
  push,
  complain,
  say,
});
const { adder, comparison, finals, importer, textures } = later;

// --- the panel ---

const thumbnails = new Thumbnails(() => page.isConnected && (page.isDone || page.isPaused), begun);
const panel = new Panel(find, {
  schema,
  library,
  acts: editor,
  stage: {
    frame: (thing) => controller.frame(thing),
    duplicate: adder.calls("duplicate"),
    poses: () => importer.now?.poses,
    takeTexture: importer.calls("texture"),
    replaceFile: importer.calls("replace"),
    takeTable: importer.calls("table"),
  },
  paint: (image, material, isWorn) => thumbnails.own(image, material, isWorn),
  say,
  textureActs: textureActs({
    editor,
    importer: { texture: importer.calls("texture") },
    thumbnails: { paint: textures.calls("paint") },
  }),
});
const outliner = new Outliner(find, { schema: schema.scene, acts: editor, add: adder.calls("add"), say });
const frame = new Frame(find, ui);

// --- the shelf ---

const saved = new SavedMaterials({ acts: editor, say, changed: (name) => shelf?.refresh(name) });
const shelf = new Shelf(find, {
  library,
  acts: editor,
  thumbnails,
  saved,
  carry: {
    stage: root,
    outline: find("outline-list"),
    shapeAt: (x, y) => controller.shapeAt(x, y),
    point: (shape) => controller.point(shape).catch(() => {}),
    prepare: () => controller.prepare().catch(() => {}),
    say,
  },
  rename: (material) => panel.materialPanel.rename(material),
  remove: (material) => panel.materialPanel.remove(material),
});
find("save-material").addEventListener("click", () => saved.save());

const lobe = new LobeOnDemand(find("lobe"), {
  acts: editor,
  schema,
  titles,
  mean: textures.calls("mean"),
  close: () => ui.set({ lobe: false }),
  complain,
});
for (const near of ["pointerenter", "focus"]) find("show-lobe").addEventListener(near, () => lobe.prepare());

const commands = makeCommands({
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
});
const keys = keyTable(commands.does);
watchButtons(find, commands.does);
watchKeys(controller.keyMove, keys);
const display = new DisplayControls({ find, page, ui, does: commands.does });

watchDrops(document, {
  take(files, at) {
    ui.set({ hint: false });
    importer.calls("take")(files, { at });
  },
  tell(text) {
    find("drop").hidden = text === null;
    find("drop-hint").textContent = text ?? "";
  },
});

// --- what is shown when something has changed ---

function tellState() {
  root.setAttribute("aria-busy", String(editor.isWaiting || !stream.isNewest(page.painted)));
  status.state(page.word(preparing.isShown));
  thumbnails.work();
}

// Tells the streams what is wanted, and the page how things stand.
function push() {
  if (!page.info) return;
  const { wanted } = page;
  const isCompared = compared(editor.state) !== null;
  if (isCompared && !comparison.now) comparison.get().catch(complain);
  comparison.now?.show(isCompared ? wanted : null, page.isPaused);
  stream.show(wanted);
  controller.frameAs(page.frame, wanted.settings);
  root.classList.toggle("checker", page.isCheckered);
  find("compare").setAttribute("aria-pressed", String(isCompared));
  tellState();
}

let saving = null;
function save() {
  clearTimeout(saving);
  saving = null;
  keepWork(essence(editor.state));
}
addEventListener("pagehide", () => {
  if (saving !== null) save(); // what changed just before the page goes
});

function refresh() {
  page.resolve();
  panel.show(editor.state, page.knobs);
  outliner.show(editor.state);
  shelf.show(editor.state);
  find("scene-title").textContent = sceneTitle();
  if (page.info) finals.now?.show();
  find("undo").disabled = !editor.canUndo;
  find("redo").disabled = !editor.canRedo;
  find("paste-material").disabled = !commands.canPaste;
  push();
  messages.review();
  controller.mark();
  lobe.refresh();
  clearTimeout(saving);
  saving = editor.canUndo || left ? setTimeout(save, SAVE_REST_MS) : null;
}

function showUi() {
  display.show();
  frame.show();
  find("lobe").hidden = !ui.state.lobe;
  find("show-lobe").setAttribute("aria-pressed", String(ui.state.lobe));
  lobe.refresh();
  controller.showUi(ui.state);
  if (ui.state.tab === "render" || ui.state.drawer === "renders") finals.get().catch(complain);
  push();
}

editor.subscribe(refresh);
offerUndo(editor, messages, titleOf);
ui.subscribe(showUi);

let resizing = 0;
new ResizeObserver(() => {
  clearTimeout(resizing);
  resizing = setTimeout(() => {
    push();
    controller.resized();
  }, RESIZE_REST_MS);
}).observe(root);

if (left?.from === "work") {
  messages.show("work", {
    title: "Your last work is back.",
    action: {
      label: "Start afresh",
      does: () => {
        forgetWork();
        messages.hide("work");
        editor.openScene(scene, name);
      },
    },
  });
}
showUi();
refresh();
stream.connect();
