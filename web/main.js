// Wires the rest. State flows one way: control -> store -> stream -> frame -> viewport.

import { fetchPreset, fetchSchema } from "./api.js";
import { Editor } from "./editor.js";
import { watchGestures, watchKeys } from "./gestures.js";
import { openLibrary } from "./library.js";
import { Messages } from "./messages.js";
import { DISPLAY, Panel } from "./panel.js";
import { defaults } from "./schema.js";
import { Status } from "./status.js";
import { Stream } from "./stream.js";
import { Viewport, pictureSize } from "./viewport.js";

const FIRST_SCENE = "sphere-on-floor";
const BOOT_RETRY_MS = 1500;
const RESIZE_REST_MS = 120; // a window being dragged restarts nothing

// Pixels that a renderer can keep up with under the hand.
const AREA = { software: 512 * 512, hardware: 1920 * 1080 };

// A picture that somebody stopped to look at; else the server chooses (null), by whether it is still changing.
const PAUSED_QUALITY = 90;

const find = (id) => document.getElementById(id);
const stage = find("stage");
const messages = new Messages(find("messages"));
const status = new Status(document);

async function load() {
  for (;;) {
    try {
      const [schema, library] = await Promise.all([fetchSchema(), openLibrary()]);
      const names = library.scenes.map(({ name }) => name);
      const name = names.includes(FIRST_SCENE) ? FIRST_SCENE : names[0];
      const scene = await fetchPreset("scenes", name);
      messages.hide("connection");
      return { schema, library, name, scene };
    } catch (problem) {
      status.state("Offline");
      messages.show("connection", { title: "The server does not answer.", detail: "Trying again…", lasting: true });
      await new Promise((wake) => { setTimeout(wake, BOOT_RETRY_MS); });
    }
  }
}

const { schema, library, name, scene } = await load();
const editor = new Editor({ schema, name, scene, complain, forgive: () => messages.hide("refusal") });
const panel = new Panel(find("panel"), { schema, library, acts: editor });

const displayDefaults = defaults(schema.view, schema.view, DISPLAY);

let info = null;
let isPaused = false;
let isConnected = false;
let ended = null; // the generation that is done
let painted = 0; // the generation on the canvas

function complain(problem) {
  const [first, ...others] = problem.errors ?? [];
  const more = others.length ? ` (and ${others.length} more)` : "";
  const detail = first ? `${first.pointer}: ${first.detail}${more}` : problem.message;
  messages.show("refusal", { title: first ? "Not taken." : "That did not work.", detail });
}

// What the chosen quality makes of the settings that are not given.
function knobs() {
  const { quality = schema.settings.properties.quality.default, time_limit, target_noise } = editor.state.settings;
  const preset = info?.quality[quality] ?? {};
  return time_limit || target_noise ? { ...preset, max_samples: null } : preset;
}

const limit = () => editor.state.settings.max_samples ?? knobs().max_samples ?? null;

// Tells the stream what is wanted, and the page how things stand.
function push() {
  if (!info) return;
  const { scene, settings, view } = editor.state;
  const area = Math.min(info.renderer?.software === false ? AREA.hardware : AREA.software, info.limits.max_pixels);
  const size = pictureSize(stage.getBoundingClientRect(), window.devicePixelRatio, area);
  stream.show({
    scene,
    settings: { ...settings, ...size },
    // Whole, because a view keeps what a message leaves out.
    view: { ...displayDefaults, ...view, format: "jpeg", quality: isPaused ? PAUSED_QUALITY : null },
  });
  status.state(!isConnected ? "Offline" : isPaused ? "Paused" : ended === painted ? "Done" : "Rendering");
}

function refresh() {
  panel.show(editor.state, knobs());
  find("undo").disabled = !editor.canUndo;
  find("redo").disabled = !editor.canRedo;
  push();
}

const viewport = new Viewport(find("picture"), (header) => {
  stage.classList.add("live");
  painted = header.generation;
  status.frame(header, limit());
  push();
});

const stream = new Stream({
  hello(hello) {
    info = hello;
    isConnected = true;
    messages.hide("connection");
    messages.hide("refusal");
    find("renderer").textContent = info.renderer?.renderer ?? "";
    viewport.restart();
    refresh();
  },
  frame: (header, blob, acknowledge) => viewport.show(header, blob, acknowledge),
  done({ generation }) {
    ended = generation;
    push();
  },
  refused(problem, valid) {
    editor.takeBack(problem, valid, (pointer, detail) => panel.mark(pointer, detail));
    complain(problem);
  },
  lost(reason, wait_ms) {
    isConnected = false;
    push();
    messages.show("connection", {
      title: "The connection to the server was lost.",
      detail: [reason, wait_ms === null ? "" : "Trying to reconnect…"].filter(Boolean).join(" "),
      action: { label: "Try now", does: () => stream.retry() },
      lasting: true,
    });
  },
});

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
    const { header, blob } = await stream.capture();
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = `sunbox-${editor.state.chosen.scene}-${header.samples}.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
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

editor.subscribe(refresh);
find("pause").addEventListener("click", togglePause);
find("download").addEventListener("click", download);
find("undo").addEventListener("click", () => travel(() => editor.undo()));
find("redo").addEventListener("click", () => travel(() => editor.redo()));
find("reset-view").addEventListener("click", () => editor.resetView());
watchGestures(stage, editor.moves);
watchKeys(editor.moves, { f: () => editor.resetView(), " ": togglePause });
document.addEventListener("keydown", (event) => {
  if (!(event.ctrlKey || event.metaKey) || event.target.dataset?.dirty) return;
  const key = event.key.toLowerCase();
  if (key === "z" && !event.shiftKey) travel(() => editor.undo());
  else if (key === "y" || key === "z") travel(() => editor.redo());
  else return;
  event.preventDefault();
});

let resizing = 0;
new ResizeObserver(() => {
  clearTimeout(resizing);
  resizing = setTimeout(push, RESIZE_REST_MS);
}).observe(stage);

refresh();
stream.connect();
