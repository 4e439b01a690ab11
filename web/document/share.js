// What a page shows, as text that fits into a link: the state, packed; and back.

import { fetchSaved, save } from "../server/api.js";
import { shareable } from "./variants.js";

const LONGEST = 8000; // characters of a fragment that chat programs still pass on
const MEMBERS = ["scene", "settings", "view", "compare", "chosen"];

export const essence = (state) =>
  Object.fromEntries(MEMBERS.filter((name) => state[name] !== null).map((name) => [name, state[name]]));

// The state that an essence stands for.
export const revived = ({ scene, settings = {}, view = {}, compare = null, chosen }) => ({
  scene,
  settings,
  view,
  compare,
  home: scene,
  chosen: { environment: "", thing: "/camera", material: Object.keys(scene.materials)[0], scene: "", ...chosen },
});

async function through(bytes, transform) {
  return new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(transform)).arrayBuffer());
}

export async function pack(value) {
  const bytes = await through(new TextEncoder().encode(JSON.stringify(value)), new CompressionStream("deflate-raw"));
  let text = "";
  for (const byte of bytes) text += String.fromCharCode(byte);
  return btoa(text).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

export async function unpack(text) {
  const packed = atob(text.replaceAll("-", "+").replaceAll("_", "/"));
  const bytes = Uint8Array.from(packed, (character) => character.charCodeAt(0));
  return JSON.parse(new TextDecoder().decode(await through(bytes, new DecompressionStream("deflate-raw"))));
}

// A link that reopens the very view. What is too long for a link goes to the server as a document of its own.
export async function linkTo(state) {
  const { scene, ...rest } = essence({ ...state, compare: shareable(state.compare) });
  const url = new URL(location.href);
  url.hash = `v=${await pack({ scene, ...rest })}`;
  if (url.hash.length <= LONGEST) return url.href;
  const name = `shared-${[...crypto.getRandomValues(new Uint8Array(8))].map((x) => x.toString(16).padStart(2, "0")).join("")}`;
  await save("scenes", name, scene, { by_link: true });
  url.hash = `s=${name}&v=${await pack(rest)}`;
  return url.href;
}

// The essence that this page's address holds, or null. Raises what is wrong with it.
export async function readLink() {
  const wanted = new URLSearchParams(location.hash.slice(1));
  if (!wanted.has("v")) return null;
  const rest = await unpack(wanted.get("v"));
  return wanted.has("s") ? { ...rest, scene: await fetchSaved("scenes", wanted.get("s")) } : rest;
}
