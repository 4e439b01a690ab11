// Two variants of one material: A is the scene's own, B stands beside it in the state's `compare`: {material, document,
// side, mode, gain, isSigned, left, right, closed}. B is kept, also while nothing is compared, until it is thrown away.
// What is seen at the left and at the right are two of: "a", "b", "photo", "snapshot TIME", "render ID". The functions
// give the members of the state that become others.

export const MODES = {
  swipe: "Swipe",
  beside: "Side by side",
  difference: "Difference",
  heat: "Heat",
  flip: "FLIP",
  verdict: "Verdict",
};
export const GAINS = [1, 2, 4, 8, 16, 64];
export const USUAL_GAIN = 4; // an eighth of the range is seen as half of it

export const ASKED = ["flip", "verdict"]; // of the server, which knows nothing of a photograph's noise

export const PHOTO = "photo";
export const SNAPSHOT = "snapshot "; // followed by its time, as the browser's storage names it
export const RENDER = "render "; // followed by its id

// What is compared, or null.
export const compared = ({ compare, scene }) =>
  compare && !compare.closed && compare.material in scene.materials ? compare : null;

export const gainOf = ({ gain }) => (GAINS.includes(gain) ? gain : USUAL_GAIN);
export const sidesOf = ({ left = "a", right = "b" }) => ({ left, right });
export const shows = (compare, name) => Object.values(sidesOf(compare)).includes(name);
export const modeOf = (compare) =>
  compare.mode in MODES && !(ASKED.includes(compare.mode) && shows(compare, PHOTO)) ? compare.mode : "swipe";

// The same, or null where B is at neither side.
export function comparedB(state) {
  const compare = compared(state);
  return compare && shows(compare, "b") ? compare : null;
}

// How many pictures are rendered at a time: A always is.
export function rendered(state) {
  const compare = compared(state);
  const isRendered = (name) => name === "b" || name.startsWith(SNAPSHOT);
  return 1 + (compare ? Object.values(sidesOf(compare)).filter(isRendered).length : 0);
}

// What is chosen for one side goes there; where the other one shows it, that takes what was here. Only a variant that
// is seen is edited.
export function placed({ compare }, place, name) {
  const sides = sidesOf(compare);
  const other = place === "left" ? "right" : "left";
  if (sides[other] === name) sides[other] = sides[place];
  const placed = { ...compare, ...sides, [place]: name };
  return { compare: shows(placed, "b") ? placed : { ...placed, side: "a" } };
}

// What a link has of it: a snapshot and a photograph are nowhere but in this browser.
export function shareable(compare) {
  const isHere = (name) => name === PHOTO || name.startsWith(SNAPSHOT);
  if (!compare || !Object.values(sidesOf(compare)).some(isHere)) return compare;
  const { left: _, right: __, ...rest } = compare;
  return rest;
}

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

// The scene with variant B in the place of A.
export const sceneOfB = ({ scene, compare }) => withMaterial(scene, compare.material, compare.document);
