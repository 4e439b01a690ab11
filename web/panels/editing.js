// What the inspector is headed with while two variants are compared: which of them the hand changes, in its tint.

import { comparedB } from "../document/variants.js";
import { inWords } from "../lib/format-text.js";

export function showEditing(find, state) {
  const compare = comparedB(state);
  const isOn = compare !== null && compare.material === state.chosen.material;
  find("editing").hidden = !isOn;
  delete find("panel").dataset.editing;
  if (!isOn) return;
  const side = compare.side.toUpperCase();
  find("panel").dataset.editing = compare.side;
  find("editing").textContent = `Editing ${side}`;
  find("editing").title = `Variant ${side} of ${inWords(compare.material)}`;
}
