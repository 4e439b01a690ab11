// Questions whose answers nobody looks at: the server's renderer has the kernels then that the panel may need next, and
// choosing another model or view does not wait for a compiler.

import { direction } from "./directions.js";

const REST_MS = 600; // between two of them, in which the picture goes on
const UP = direction(0, 0);

// What each path is asked to have its kernel compiled, by the views' `needs`. Not the terms: their kernels take a tenth of
// a second, and models without them would refuse.
const QUESTIONS = {
  "/v1/bsdf": ["", { wo: [UP], wi: [UP] }],
  "/v1/bsdf/albedo": ["/albedo", { cosines: [1], samples: 1 }],
};

export class Warming {
  #done = new Set();
  #round = 0;

  // `turn(material, type)` promises it as another model.
  constructor(ask, turn) {
    Object.assign(this, { ask, turn });
  }

  // `wanted` are [{material, type, needs}] in the order of their need; with a `type` the material is turned into that
  // model. What was begun before ends.
  async begin(wanted, rest_ms = REST_MS) {
    const round = ++this.#round;
    for (const { material, type = material.type, needs } of wanted) {
      const key = `${type} ${needs}`;
      if (this.#done.has(key) || !(needs in QUESTIONS)) continue;
      await new Promise((resolve) => {
        setTimeout(resolve, rest_ms);
      });
      if (round !== this.#round) return;
      this.#done.add(key);
      const [path, body] = QUESTIONS[needs];
      await (type === material.type ? Promise.resolve(material) : this.turn(material, type))
        .then((turned) => this.ask(path, { material: turned, ...body }))
        .catch(() => this.#done.delete(key)); // the panel itself says what is wrong
    }
  }

  end() {
    this.#round += 1;
  }
}
