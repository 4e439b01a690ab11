// The view of a scene in a notebook. The kernel alone talks to the server: scenes and frames come from it, edits go to it.
// One edit is under way at a time, and what the hand does meanwhile goes with the next one.

import { beginIds, element } from "../lib/dom.js";
import { amount, percent } from "../lib/format-text.js";
import { diff } from "../lib/patch.js";
import { cameraModels, defaults } from "../server/schema.js";
import { panel } from "./panel.js";
import { picture } from "./picture.js";

const PATIENCE_MS = 2000; // until somebody is told that the kernel is busy
const BUSY = "The kernel is busy. The picture follows when it is free.";

function view({ model, el }) {
  beginIds(crypto.getRandomValues(new Uint16Array(1))[0] * 1000); // a page has many views, each with this module of its own
  const me = crypto.randomUUID();
  const status = element("output", { class: "status", role: "status" });
  const samples = element("span", { class: "samples" });
  let scene = null; // as the hand has it
  let sent = null; // as the kernel has it
  let home = null; // the camera that came with the scene
  let schema = null;
  let side = null;
  let waits = 0; // timer of the edit that is under way; 0: none is
  let number = 0;

  const send = (type, more) => model.send({ type, view: me, ...more });
  const say = (text) => {
    status.textContent = text;
  };

  const flush = () => {
    if (waits || !scene) return;
    const patch = diff(sent, scene);
    if (patch === undefined) return;
    sent = scene;
    number += 1;
    waits = setTimeout(say, PATIENCE_MS, BUSY);
    send("edit", { number, patch });
  };
  const change = (next) => {
    scene = next;
    show();
    flush();
  };
  const camera = () => {
    const models = cameraModels(schema);
    const [usual] = Object.keys(models);
    return { ...defaults(schema, models[scene.camera?.type ?? usual]), ...scene.camera };
  };
  const move = (changes) => {
    if (scene) change({ ...scene, camera: { ...scene.camera, ...changes } });
  };
  const canvas = picture({ camera, move });
  const show = () => side?.show(scene, model.get("material"));

  const heard = {
    begin({ schema: described, presets, scene: first }) {
      schema = described;
      side = panel({
        schema,
        presets,
        current: () => scene,
        change,
        take: (kind, name) => send("preset", { kind, name }),
        choose(name) {
          model.set("material", name);
          model.save_changes();
        },
        home: () => move({ ...home }),
      });
      root.append(side.element);
      heard.scene({ scene: first, is_home: true });
    },
    scene({ scene: next, is_home: isHome, but }) {
      if (!side || but === me) return;
      scene = next;
      sent = next;
      if (isHome) home = next.camera;
      say("");
      show();
    },
    taken({ number: taken }) {
      if (taken !== number) return;
      clearTimeout(waits);
      waits = 0;
      if (status.textContent === BUSY) say("");
      flush();
    },
    refused({ pointer, detail, scene: last }) {
      heard.scene({ scene: last });
      if (!side?.mark(pointer, detail)) say(pointer ? `${pointer}: ${detail}` : detail);
    },
    async frame(frame, [bytes]) {
      try {
        await canvas.paint(frame, bytes);
      } finally {
        send("ack", { seq: frame.seq });
      }
      const noise = frame.noise === null ? "" : `, ${percent(frame.noise)} noise`;
      samples.textContent = `${amount(frame.samples, "sample")}${noise}`;
    },
  };
  const hear = (message, buffers) => {
    if (!message.view || message.view === me) heard[message.type]?.(message, buffers);
  };

  const root = element(
    "div",
    {
      class: "sunbox-view",
      // JupyterLab's keys are for its cells: it looks at the element that has the focus.
      onfocusin: ({ target }) => target.setAttribute("data-lm-suppress-shortcuts", "true"),
      // Nor does Enter reach what a browser does with it.
      onkeydown: ({ key, target }) => {
        if (key === "Enter" && target.type === "text") target.dispatchEvent(new Event("change"));
      },
    },
    element("div", { class: "shown" }, canvas.element, element("div", { class: "line" }, samples, status)),
  );
  el.append(root);
  model.on("msg:custom", hear);
  model.on("change:material", show);

  // Nobody needs frames that nobody sees.
  let isSeen = true;
  const look = (isIn) => {
    const seen = isIn && document.visibilityState === "visible";
    if (seen === isSeen) return;
    isSeen = seen;
    send(seen ? "seen" : "unseen");
  };
  let isIn = true;
  const observer = new IntersectionObserver((entries) => {
    isIn = entries.at(-1).isIntersecting;
    look(isIn);
  });
  const turned = () => look(isIn);
  observer.observe(canvas.element);
  document.addEventListener("visibilitychange", turned);
  send("hello");

  return () => {
    observer.disconnect();
    document.removeEventListener("visibilitychange", turned);
    model.off("msg:custom", hear);
    model.off("change:material", show);
    clearTimeout(waits);
    send("unseen");
  };
}

export default { render: view };
