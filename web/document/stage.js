// What things stand on, of the editor's own: a wide ground, or a cyclorama, a floor that rises to a wall without an edge.

import { fetchPreset } from "../server/api.js";
import { isFlat } from "./kinds.js";
import { fresh, users } from "./materials.js";
import { without } from "./outline.js";
import { ballOf, union } from "./placing.js";
import { pointer } from "../lib/patch.js";

// The names of their shapes, of which a scene has one at most.
const NAMES = { Stage: "ground", Cyclorama: "cyclorama" };
const WIDE = 12; // half the ground's width, in radii of what stands on it
// What the built-in cyclorama is made for: the radius of what stands on it, and how far away the camera is, in metres.
const FITS = { radius: 1.4, distance: 6.5 };
const TALL = 0.15; // of a model's width: what is flatter is a ground itself
const GROUND = /ground|floor|terrain|plane|landscape|stage|cyclorama/i;

const rounded = (v) => v.map((x) => Number(x.toPrecision(6)) + 0);

export const isStage = ({ name }) => Object.hasOwn(NAMES, name ?? "");

// "none", "ground" or "cyclorama".
export const stageOf = ({ shapes }) => NAMES[shapes.find(isStage)?.name] ?? "none";

// A ground under a box.
export function groundUnder({ low, high }, material) {
  const { center, radius } = ballOf({ low, high });
  const reach = WIDE * Math.max(radius, 1e-3);
  const origin = rounded([center[0] - reach, low[1], center[2] + reach]);
  return { type: "quad", name: "Stage", origin, u: [2 * reach, 0, 0], v: [0, 0, -2 * reach], material };
}

// The cyclorama's shape under a box, its wall behind it as the camera sees it.
function cycloramaUnder(shape, around, camera, material) {
  const { center, radius } = ballOf(around);
  const [right, back] = [0, 2].map((k) => camera.position[k] - center[k]);
  const factor = Math.max(radius / FITS.radius, Math.hypot(right, back) / FITS.distance, 1e-3);
  const transform = {
    translate: rounded([center[0], around.low[1], center[2]]),
    rotate: [0, Number(((Math.atan2(right, back) * 180) / Math.PI).toFixed(1)) + 0, 0],
    scale: Number(factor.toPrecision(4)),
  };
  return { ...shape, transform, material };
}

// The members of the state with another stage: "none", "ground" or "cyclorama". `boxes` of the shapes, null where one
// is not known; `acts` the editor.
export async function staged(acts, boxes, kind) {
  const preset = kind === "cyclorama" ? await fetchPreset("stages", kind) : null;
  const { scene, chosen } = acts.state;
  const bodies = boxes.filter(
    (each, i) => each && scene.shapes[i] && !isFlat(scene.shapes[i]) && !isStage(scene.shapes[i]),
  );
  const at = scene.shapes.findIndex(isStage);
  const before = scene.shapes[at];
  if (kind === "none") return before ? bare(acts.state, at) : {};
  const around = bodies.length ? union(bodies) : inView(acts.camera);
  const material = before?.material ?? fresh(preset ? "Backdrop" : "Ground", scene.materials);
  const own = preset ? preset.materials[preset.shapes[0].material] : acts.plainMaterial;
  const made = preset
    ? cycloramaUnder(preset.shapes[0], around, acts.camera, material)
    : groundUnder(around, material);
  const place = before ? at : scene.shapes.length;
  const shapes = [...scene.shapes.slice(0, place), made, ...scene.shapes.slice(place + 1)];
  return {
    scene: { ...scene, shapes, materials: { [material]: own, ...scene.materials } },
    chosen: { ...chosen, thing: pointer("shapes", place), material },
  };
}

// Without the stage, and without its material where no other thing is made of that.
function bare({ scene, chosen }, at) {
  const { material } = scene.shapes[at];
  const left = without({ scene, chosen }, [pointer("shapes", at)]);
  const [first] = left.scene.shapes;
  if (!first || users(left.scene, material).length) return first ? left : {};
  const { [material]: _, ...materials } = scene.materials;
  return { scene: { ...left.scene, materials }, chosen: left.chosen };
}

// A box that the picture shows the middle of.
function inView({ position, target }) {
  const reach = Math.hypot(...target.map((x, k) => x - position[k])) / 4;
  return { low: target.map((x) => x - reach), high: target.map((x) => x + reach) };
}

// A model that was opened, on a ground where it brings none: not where it is flat itself, or a room around its camera.
export function grounded(document, { low, high }, material) {
  const [wide, tall, deep] = low.map((x, k) => high[k] - x);
  const isRoom = document.camera.position.every((x, k) => low[k] < x && x < high[k]);
  const isGround = document.shapes.some((shape) => isFlat(shape) || GROUND.test(shape.name ?? ""));
  if (isRoom || isGround || tall < TALL * Math.max(wide, deep) || !document.shapes.length) return document;
  const name = fresh("Ground", document.materials);
  return {
    ...document,
    shapes: [...document.shapes, groundUnder({ low, high }, name)],
    materials: { ...document.materials, [name]: material },
  };
}
