// Two variants of one material: A is the scene's own, B stands beside it in the state's `compare`: {material, document,
// side, mode, gain, closed}. B is kept, also while nothing is compared, until it is thrown away. The functions give the
// members of the state that become others.

export const MODES = { swipe: "Swipe", beside: "Side by side", difference: "Difference", heat: "Heat" };
export const GAINS = [1, 2, 4, 8, 16, 64];
export const USUAL_GAIN = 4; // an eighth of the range is seen as half of it

// What is compared, or null.
export const compared = ({ compare }) => (compare && !compare.closed ? compare : null);

export const modeOf = ({ mode }) => (mode in MODES ? mode : "swipe");
export const gainOf = ({ gain }) => (GAINS.includes(gain) ? gain : USUAL_GAIN);

// Where B is at hand it is shown again. Else it begins as a copy of the material in hand, so that what changes from
// here on shows.
export function begun({ compare, chosen, scene }) {
  if (!(compare && compare.material in scene.materials))
    return { compare: { material: chosen.material, document: scene.materials[chosen.material], side: "a" } };
  const { closed: _, ...open } = compare;
  return { compare: { ...open, side: "a" }, chosen: { ...chosen, material: compare.material } };
}

export const ended = ({ compare }) => ({ compare: { ...compare, side: "a", closed: true } });

export const sided = ({ compare, chosen }, side) => ({
  compare: { ...compare, side },
  chosen: { ...chosen, material: compare.material },
});

const withMaterial = (scene, name, document) => ({ ...scene, materials: { ...scene.materials, [name]: document } });

export const swapped = ({ compare, scene }) => ({
  compare: { ...compare, document: scene.materials[compare.material] },
  scene: withMaterial(scene, compare.material, compare.document),
});

// The scene with variant B in the place of A, or null.
export function sceneOfB(state) {
  const { scene } = state;
  const compare = compared(state);
  if (!compare || !scene.materials[compare.material]) return null;
  return withMaterial(scene, compare.material, compare.document);
}
