// Files that are dropped, picked, or handed out.

import { element } from "./dom.js";

const KINDS = {
  gltf: "scene",
  glb: "scene",
  zip: "scene",
  mtlx: "scene",
  usdz: "scene",
  usd: "scene",
  usda: "scene",
  usdc: "scene",
  fbx: "scene",
  dae: "scene",
  "3ds": "scene",
  x3d: "scene",
  "3mf": "scene",
  step: "scene",
  stp: "scene",
  obj: "mesh",
  ply: "mesh",
  stl: "mesh",
  hdr: "light",
  exr: "light",
  png: "image",
  jpg: "image",
  jpeg: "image",
  webp: "image",
  cube: "table",
  binary: "measurement",
  bsdf: "measurement",
  json: "json",
  sunbox: "json",
};

// What a file is by its ending: scene, mesh, light, image, table, measurement or json; undefined for others.
export const kindOf = (file) => KINDS[file.name.split(".").at(-1).toLowerCase()];

// The endings of files of these kinds, as a file picker takes them.
export const accepted = (kinds) =>
  Object.keys(KINDS)
    .filter((ending) => kinds.includes(KINDS[ending]))
    .map((ending) => `.${ending}`)
    .join(",");

// Calls `take(file)` with the first file dropped onto an element; the page's own drop stays out of it.
export function acceptFiles(node, take) {
  node.addEventListener("dragover", (event) => {
    if (!event.dataTransfer.types.includes("Files")) return;
    event.preventDefault();
    event.stopPropagation();
    node.classList.add("over");
  });
  node.addEventListener("dragleave", () => node.classList.remove("over"));
  node.addEventListener("drop", (event) => {
    node.classList.remove("over");
    const [file] = event.dataTransfer.files;
    if (!file) return;
    event.preventDefault(); // the page sees it too, and only puts its own hint away
    take(file);
  });
}

// Files that the person picks: [] for none.
export function browse(accept) {
  return new Promise((resolve) => {
    const input = element("input", {
      type: "file",
      accept,
      multiple: true,
      class: "unseen",
      tabindex: "-1",
      "aria-label": "File",
      onchange: () => {
        input.remove();
        resolve([...input.files]);
      },
      oncancel: () => {
        input.remove();
        resolve([]);
      },
    });
    document.body.append(input); // some browsers forget one that stands nowhere
    input.click();
  });
}

// Hands a file to the person.
export function saveAs(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

export const jsonBlob = (document) =>
  new Blob([`${JSON.stringify(document, null, 2)}\n`], { type: "application/json" });
