// What went wrong, in the words of whoever works here: names of controls in the place of JSON pointers, and sentences
// in the place of what the browser or the protocol says.

import { Problem } from "./api.js";
import { inWords, sentence } from "../lib/format-text.js";

const LONGEST_LIST = 100; // characters of what would have been right; a longer list helps nobody
const VERB = /^(must|is|are|has|have|needs?|cannot|can|does|do|refers?|lies|spans?)\b/;

const BY_STATUS = {
  401: "The server asks for a key.",
  403: "The server does not allow this.",
  404: "The server does not have this.",
  413: "This is too large for the server.",
  429: "The server is busy. Try again in a moment.",
  503: "The server is busy. Try again in a moment.",
};

// {name: title} of every field of a schema.
export function fieldTitles(...schemas) {
  const owners = schemas.flatMap((schema) => [...Object.values(schema.$defs ?? {}), schema]);
  return Object.fromEntries(
    owners.flatMap(({ properties = {} }) =>
      Object.entries(properties)
        .filter(([, { title }]) => title)
        .map(([name, { title }]) => [name, title]),
    ),
  );
}

const OWNERS = {
  materials: (name) => `material ${inWords(name)}`,
  textures: (name) => `image ${name}`,
  shapes: (index) => `shape ${Number(index) + 1}`,
  lights: (index) => `light ${Number(index) + 1}`,
};
const SINGLES = { camera: "the camera", environment: "the environment" };

// "/scene/materials/a/roughness" -> "Roughness of material A".
function placeWords(pointer, titles = {}) {
  const parts = pointer
    .split("/")
    .slice(1)
    .map((part) => part.replaceAll("~1", "/").replaceAll("~0", "~"));
  const [root, kind, ...rest] = parts;
  if (root !== "scene") return titles[kind] ?? (kind ? inWords(kind) : "This");
  if (!kind) return "The scene";
  const single = SINGLES[kind];
  const owner = single ?? (rest.length ? OWNERS[kind]?.(rest.shift()) : undefined);
  if (!owner) return titles[kind] ?? inWords(kind);
  const [field] = rest;
  return field === undefined ? sentence(owner) : `${titles[field] ?? `“${field}”`} of ${owner}`;
}

const IN_FILE = {
  materials: "Material",
  meshes: "Mesh",
  nodes: "Node",
  textures: "Texture",
  images: "Image",
  cameras: "Camera",
  lights: "Light",
  accessors: "Accessor",
  bufferViews: "Buffer view",
  buffers: "Buffer",
  skins: "Skin",
  samplers: "Sampler",
  scenes: "Scene",
};

// "/materials/3/normalTexture" -> "Material 4": the place in a model file, or "" where its details say enough alone.
function filePlaceWords(pointer) {
  const parts = pointer.split("/").slice(1);
  const at = parts[0] === "extensions" ? 2 : 0;
  const [kind, index] = parts.slice(at);
  return IN_FILE[kind] && /^\d+$/.test(index ?? "") ? `${IN_FILE[kind]} ${Number(index) + 1}` : "";
}

// "/materials/3/alphaMode" -> "Material 4, alphaMode": a value that has to be mended in the file itself.
export function fileValueWords(pointer) {
  const place = filePlaceWords(pointer);
  const value = pointer
    .split("/")
    .slice(3)
    .findLast((part) => !/^\d+$/.test(part));
  return [place, place && value].filter(Boolean).join(", ");
}

// A warning of an import, as a sentence.
export function warningText({ pointer = "", detail }) {
  const place = filePlaceWords(pointer);
  return place ? `${place}: ${detail}` : sentence(detail);
}

// What a format has no place for, as a line: "Roughness of material A: ...".
export function lossText({ pointer, detail, count = 1 }, titles) {
  const others = count > 1 ? `, and ${count - 1} more` : "";
  return `${placeWords(pointer, titles)}${others}: ${detail}`;
}

const ended = (text) => (/[.!?…]$/.test(text) ? text : `${text}.`);

// What is wrong with a value, short enough to stand beside it.
export function detailWords(detail) {
  const [first, ...others] = detail.split("; ");
  const all = others.join("; ");
  return ended(all && all.length <= LONGEST_LIST ? `${first}; ${all}` : first);
}

// `place` puts the pointer of a bad value into words.
export function problemText(problem, titles = {}, place = (pointer) => placeWords(pointer, titles)) {
  const [first, ...others] = problem.errors ?? [];
  if (first) {
    // What was found in a file is told with its place before it.
    const [, told = first.detail] = first.pointer ? first.detail.split(`${first.pointer}: `) : [];
    const words = detailWords(told);
    const where = place(first.pointer);
    const more = others.length
      ? ` ${others.length === 1 ? "Another value is" : `${others.length} other values are`} wrong, too.`
      : "";
    if (!where) return sentence(words) + more;
    return (VERB.test(words) ? `${where} ${words}` : `${where}: ${words}`) + more;
  }
  if (problem instanceof SyntaxError) return "This is not valid JSON.";
  if (problem instanceof Problem && (problem.isGeneric || problem.status === 429 || problem.status === 503)) {
    return (
      BY_STATUS[problem.status] ??
      (problem.status >= 500
        ? "Something went wrong on the server. Its log says more."
        : "The server does not take this.")
    );
  }
  return ended(sentence(problem.message));
}
