// What things stand on, of the editor's own: a wide ground.

import { ballOf } from "./placing.js";

const STAGE = "Stage"; // the name of its shape: there is one at most
const WIDE = 12; // half its width, in radii of what stands on it

export const isStage = ({ name }) => name === STAGE;

// A ground under a box.
export function groundUnder({ low, high }, material) {
  const { center, radius } = ballOf({ low, high });
  const reach = WIDE * Math.max(radius, 1e-3);
  const origin = [center[0] - reach, low[1], center[2] + reach].map((each) => Number(each.toPrecision(6)));
  return { type: "quad", name: STAGE, origin, u: [2 * reach, 0, 0], v: [0, 0, -2 * reach], material };
}
