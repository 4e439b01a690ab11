// How pictures of materials are made: by the service, on a stage like that of the presets, or of another picture.

import { fetchPreset, renderPicture } from "../server/api.js";
import { recall, remember } from "../lib/browser-storage.js";
import { received, unpacked, withTextures } from "../document/material-set.js";

const SIDE = 144;
const SETTINGS = { width: SIDE, height: SIDE, max_samples: 16, max_bounces: 8, seed: 1, denoise: true };
let stage = null;

// The stage that every material stands on: the one in which `tests/bench/thumbnails.py` shows most of the presets.
export async function studio() {
  const [set, cyclorama, environment] = await Promise.all([
    fetch(new URL("thumbnails/studio.json", document.baseURI)).then((answer) => answer.json()),
    fetchPreset("stages", "cyclorama"),
    fetchPreset("environments", "studio"),
  ]);
  const materials = { ...set.materials, ...cyclorama.materials };
  return { ...set, environment, materials, shapes: [...set.shapes, ...cyclorama.shapes] };
}

// With a material on its subject, bare or with its textures.
function staged(scene, document) {
  const { material, textures } = received(scene, unpacked(document)[0]);
  return withTextures({ ...scene, materials: { ...scene.materials, subject: material } }, textures);
}

const hash = async (document) => {
  const digest = await crypto.subtle.digest("SHA-256", new TextEncoder().encode(JSON.stringify(document)));
  return [...new Uint8Array(digest.slice(0, 12))].map((byte) => byte.toString(16).padStart(2, "0")).join("");
};

// The middle of a picture, as a square.
export function cropped(picture) {
  const canvas = new OffscreenCanvas(SIDE, SIDE);
  const side = Math.min(picture.width, picture.height);
  const [left, top] = [(picture.width - side) / 2, (picture.height - side) / 2];
  canvas.getContext("2d").drawImage(picture, left, top, side, side, 0, 0, SIDE, SIDE);
  return canvas.convertToBlob({ type: "image/webp" });
}

// A material's picture, kept from before or, where it is not to be `isRendered`, nothing.
export async function rendered(document, isRendered, signal) {
  const name = `picture on the cyclorama ${self.crypto.subtle ? await hash(document) : JSON.stringify(document)}`;
  const kept = await recall(name);
  if (kept || !isRendered) return kept;
  stage ??= await studio();
  const blob = await renderPicture(staged(stage, document), SETTINGS, signal);
  remember(name, blob);
  return blob;
}
