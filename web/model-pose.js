// How a model that moves or has variants is taken: which variant, which animation, at which time. A small picture shows
// it in its plain colours, for which the renderer prepares nothing that it has not for other models.

import { ask as confirm } from "./lib/ask.js";
import { element, freshId } from "./lib/dom.js";
import { fetchPosedScene, renderPicture } from "./server/api.js";
import { problemText } from "./server/problem-text.js";
import { fields, materialModels, newMaterial } from "./server/schema.js";

const STEPS = 200; // of the slider over an animation
const SHOWN = { width: 320, height: 200, max_samples: 8, max_bounces: 3 };
const REST_MS = 120; // after a move of the slider: the server poses the model anew for each picture

const seconds = (value) => `${value.toFixed(2)} s`;

function menu(id, label, none, names) {
  const options = [["", none], ...names.map((name) => [name, name])];
  const select = element("select", { id }, ...options.map(([value, title]) => element("option", { value }, title)));
  return { select, row: element("div", { class: "row pose" }, element("label", { for: id }, label), select) };
}

// A scene in the plain material of a schema, with the first colour that each of its own materials has.
function simple(scene, schema) {
  const models = materialModels(schema);
  const colored = ({ type }) => fields(schema, models[type]).find(({ widget }) => widget === "color");
  const plain = newMaterial(schema);
  const { name: to } = colored(plain);
  const made = (material) => {
    const { name, initial } = colored(material) ?? {};
    return { ...plain, [to]: material[name] ?? initial ?? plain[to] };
  };
  const materials = Object.entries(scene.materials).map(([name, material]) => [name, made(material)]);
  return { ...scene, materials: Object.fromEntries(materials) };
}

// The pose that the person takes, {} for the model as it was saved; null where they think better of it. `schema` is that of
// scenes, `info` what the server says of the file, `action` what the button does under the `title`.
export async function askPose(
  schema,
  file,
  { id, variants = [], animations = [] },
  { action, title = `Open ${file.name} as` },
) {
  const own = freshId("pose");
  const variant = menu(`${own}-variant`, "Variant", "As it was saved", variants);
  const animation = menu(
    `${own}-animation`,
    "Animation",
    "At rest",
    animations.map(({ name }) => name),
  );
  const time = element("input", { id: `${own}-time`, type: "range", min: "0", value: "0", step: "any" });
  const reading = element("output", { class: "unit", for: time.id });
  const timing = element("div", { class: "row pose" }, element("label", { for: time.id }, "Time"), time, reading);
  const picture = element("img", { class: "pose-picture", alt: "The model as it will be" });
  const trouble = element("p", { class: "trouble", role: "alert", hidden: true });
  const duration = () => animations.find(({ name }) => name === animation.select.value)?.duration ?? 0;
  const pose = () => ({
    ...(variant.select.value ? { variant: variant.select.value } : {}),
    ...(animation.select.value ? { animation: animation.select.value, time: time.value } : {}),
  });
  const shown = new PosedPicture(schema, id, picture, trouble);
  const changed = () => {
    const end = duration();
    timing.hidden = !end;
    Object.assign(time, { max: String(end), step: end ? String(end / STEPS) : "any" });
    time.style.setProperty("--share", String(end ? time.valueAsNumber / end : 0));
    reading.textContent = seconds(time.valueAsNumber);
    time.setAttribute("aria-valuetext", `${seconds(time.valueAsNumber)} of ${seconds(end)}`);
    shown.show(pose());
  };
  for (const each of [variant.select, time]) each.addEventListener("input", changed);
  animation.select.addEventListener("input", () => {
    time.value = "0";
    changed();
  });
  changed();
  const taken = await confirm({
    title,
    yes: action,
    body: [
      element("div", { class: "pose-stage" }, picture, element("p", { class: "dim" }, "Its picture is on the way…")),
      trouble,
      variants.length ? variant.row : null,
      ...(animations.length ? [animation.row, timing] : []),
    ].filter(Boolean),
  });
  shown.leave();
  return taken ? pose() : null;
}

// The last pose that was asked for, rendered small.
class PosedPicture {
  #wanted = null;
  #timer = null;
  #asked = null;

  constructor(schema, id, image, trouble) {
    Object.assign(this, { schema, id, image, trouble });
  }

  show(pose) {
    this.#wanted = pose;
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#render(), REST_MS);
  }

  leave() {
    clearTimeout(this.#timer);
    this.#asked?.abort();
    URL.revokeObjectURL(this.image.src);
  }

  async #render() {
    this.#asked?.abort();
    const { signal } = (this.#asked = new AbortController());
    this.image.setAttribute("aria-busy", "true");
    try {
      const { document } = await fetchPosedScene(this.id, this.#wanted, signal);
      const blob = await renderPicture(simple(document, this.schema), SHOWN, signal);
      URL.revokeObjectURL(this.image.src);
      this.image.src = URL.createObjectURL(blob);
      this.trouble.hidden = true;
    } catch (problem) {
      if (problem.name === "AbortError") return;
      this.trouble.hidden = false;
      this.trouble.textContent = problemText(problem);
    }
    if (!signal.aborted) this.image.removeAttribute("aria-busy");
  }
}
