// What a model's own lights ask for: an exposure of the view, and a studio where the model has no sky.

import { fetchPreset } from "../server/api.js";

// The part of the state that shows a newly opened scene in the right light. `exposure` is what suits its lights, in
// stops, or undefined. An exposure that an earlier scene brought along, and that nobody changed, goes with that scene.
export function exposed({ view, chosen }, exposure) {
  if (exposure !== undefined) return { view: { ...view, exposure } };
  if (chosen.exposure === undefined || view.exposure !== chosen.exposure) return {};
  const { exposure: _, ...rest } = view;
  return { view: rest };
}

export const isUnderNoSky = ({ lights = [], environment }) => lights.length > 0 && !environment;

// The studio, as bright in a view of this exposure as it is in one of 0.
export async function studio(exposure = 0) {
  const environment = await fetchPreset("environments", "studio");
  return exposure ? { ...environment, scale: 2 ** -exposure } : environment;
}
