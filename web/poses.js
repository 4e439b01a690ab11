// Models that move: they come in at rest, and stand in another pose when somebody asks for it in the inspector.

import { moved } from "./document/moving.js";
import { equal, pointer } from "./lib/patch.js";
import { fetchPosedScene } from "./server/api.js";

const isOf = (part, { name, asset }) => asset !== undefined && part.asset === asset && part.name === name;

// {shapes, parts}: `shapes` with those of a model in another pose, which `posed` are, in their order and where the
// model was put; `parts` are the model's as they came. What was moved by hand since then stays where it is.
export function inPose(shapes, parts, posed, offset) {
  const left = shapes.map((_, i) => i);
  const all = [...shapes];
  const made = posed.map((each) => moved(each, offset));
  parts.forEach((part, k) => {
    const at = left.findIndex((i) => i !== null && isOf(part, shapes[i]));
    if (at < 0 || !made[k]) return; // it was deleted
    left[at] = null;
    const { transform, ...rest } = shapes[at];
    const isWhere = equal(transform, part.transform);
    const own = isWhere ? made[k].transform : transform;
    all[at] = { ...rest, asset: made[k].asset, ...(own ? { transform: own } : {}) };
  });
  return { shapes: all, parts: made };
}

export class Poses {
  #models = []; // {id, file, info, offset, parts}, in this page

  // `schema` of scenes, `acts` the editor; `refuse(file, problem)` says what went wrong.
  constructor({ schema, acts, refuse }) {
    Object.assign(this, { schema, acts, refuse });
  }

  // A model with animations came in as these shapes, which were put there by `offset`.
  keep({ id, file, info, offset = [0, 0, 0], shapes }) {
    this.#models.push({ id, file, info, offset, parts: shapes.map((each) => moved(each, offset)) });
  }

  #modelOf(shape) {
    return this.#models.findLast(({ parts }) => parts.some((part) => isOf(part, shape)));
  }

  // Whether a shape is a part of such a model.
  has(shape) {
    return this.#modelOf(shape) !== undefined;
  }

  // Asks how the model of a shape of the scene stands, and has it stand so.
  async ask(index) {
    const model = this.#modelOf(this.acts.state.scene.shapes[index] ?? {});
    if (!model) return;
    const { id, file, info, offset } = model;
    const asked = { action: "Pose", title: `Pose of ${file.name}` };
    const { askPose } = await import("./model-pose.js");
    const pose = await askPose(this.schema, file, { id, animations: info.animations }, asked);
    if (!pose) return;
    try {
      const { document } = await fetchPosedScene(id, pose);
      const { scene, chosen } = this.acts.state;
      const { shapes, parts } = inPose(scene.shapes, model.parts, document.shapes, offset);
      // Undo gives back a pose that is known as well.
      this.#models.push({ ...model, parts });
      this.acts.change({ scene: { ...scene, shapes }, chosen: { ...chosen, thing: pointer("shapes", index) } });
    } catch (problem) {
      this.refuse(file, problem);
    }
  }
}
