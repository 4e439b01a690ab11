// What went wrong, in the words of whoever works here: names of controls in the place of JSON pointers, and sentences
// in the place of what the browser or the protocol says.

import { Problem } from "./api.js";
import { inWords, sentence } from "./words.js";

const LONGEST_LIST = 100; // characters of what would have been right; a longer list helps nobody
const VERB = /^(must|is|are|has|have|needs?|cannot|can|does|do|refers?|lies|spans?)\b/;

const BY_STATUS = {
  401: "The server asks for a key.", 403: "The server does not allow this.", 404: "The server does not have this.",
  413: "This is too large for the server.", 429: "The server is busy. Try again in a moment.",
  503: "The server is busy. Try again in a moment.",
};

// {name: title} of every field of a schema.
export function fieldTitles(...schemas) {
  const owners = schemas.flatMap((schema) => [...Object.values(schema.$defs ?? {}), schema]);
  return Object.fromEntries(owners.flatMap(({ properties = {} }) =>
    Object.entries(properties).filter(([, { title }]) => title).map(([name, { title }]) => [name, title])));
}

const OWNERS = {
  materials: (name) => `material ${inWords(name)}`, textures: (name) => `image ${name}`,
  shapes: (index) => `shape ${Number(index) + 1}`, lights: (index) => `light ${Number(index) + 1}`,
};
const SINGLES = { camera: "the camera", environment: "the environment" };

// "/scene/materials/a/roughness" -> "Roughness of material A".
export function placeWords(pointer, titles = {}) {
  const parts = pointer.split("/").slice(1).map((part) => part.replaceAll("~1", "/").replaceAll("~0", "~"));
  const [root, kind, ...rest] = parts;
  if (root !== "scene") return titles[kind] ?? (kind ? inWords(kind) : "This");
  if (!kind) return "The scene";
  const single = SINGLES[kind];
  const owner = single ?? (rest.length ? OWNERS[kind]?.(rest.shift()) : undefined);
  if (!owner) return titles[kind] ?? inWords(kind);
  const [field] = rest;
  return field === undefined ? sentence(owner) : `${titles[field] ?? `“${field}”`} of ${owner}`;
}

const ended = (text) => (/[.!?…]$/.test(text) ? text : `${text}.`);

// What is wrong with a value, short enough to stand beside it.
export function detailWords(detail) {
  const [first, ...others] = detail.split("; ");
  const all = others.join("; ");
  return ended(all && all.length <= LONGEST_LIST ? `${first}; ${all}` : first);
}

export function problemText(problem, titles = {}) {
  const [first, ...others] = problem.errors ?? [];
  if (first) {
    const words = detailWords(first.detail);
    const place = placeWords(first.pointer, titles);
    const more = others.length ? ` ${others.length === 1 ? "Another value is" : `${others.length} other values are`} wrong, too.` : "";
    return (VERB.test(words) ? `${place} ${words}` : `${place}: ${words}`) + more;
  }
  if (problem instanceof SyntaxError) return "This is not valid JSON.";
  if (problem instanceof Problem && (problem.isGeneric || problem.status === 429 || problem.status === 503)) {
    return BY_STATUS[problem.status] ?? (problem.status >= 500 ? "The server failed at this. Its log says why." : "The server does not take this.");
  }
  return ended(sentence(problem.message));
}
