// What a picture was made from, read from a file of it.

import { isObject } from "../lib/patch.js";
import { ascii, KEY, latin, MOST, PNG, through } from "./recipe.js";

const EXR = [0x76, 0x2f, 0x31, 0x01];

async function pngText(bytes) {
  const view = new DataView(bytes.buffer);
  for (let at = PNG.length; at + 12 <= bytes.length; at += 12 + view.getUint32(at)) {
    const kind = latin(bytes.subarray(at + 4, at + 8));
    if (!["tEXt", "zTXt", "iTXt"].includes(kind)) continue;
    const body = bytes.subarray(at + 8, at + 8 + view.getUint32(at));
    if (latin(body.subarray(0, KEY.length + 1)) !== `${KEY}\0`) continue;
    const rest = body.subarray(KEY.length + 1);
    if (kind === "tEXt") return rest;
    if (kind === "zTXt") return through(rest.subarray(1), new DecompressionStream("deflate"));
    const text = rest.subarray(rest.indexOf(0, rest.indexOf(0, 2) + 1) + 1); // after the language and the translated key
    return rest[0] ? through(text, new DecompressionStream("deflate")) : text;
  }
  return null;
}

// Of the XMP packet: the text with XML's escapes, or deflated in base64.
async function webpText(bytes) {
  const view = new DataView(bytes.buffer);
  for (let at = 12, size; at + 8 <= bytes.length; at += 8 + size + (size % 2)) {
    size = view.getUint32(at + 4, true);
    if (latin(bytes.subarray(at, at + 4)) !== "XMP ") continue;
    const [, name, value] = latin(bytes.subarray(at + 8, at + 8 + size)).match(/ sunbox:(\w+)="([^"]*)"/) ?? [];
    if (name === "recipe")
      return ascii(new DOMParser().parseFromString(`<a>${value}</a>`, "text/xml").documentElement.textContent);
    if (name === "deflated")
      return through(
        Uint8Array.from(atob(value), (each) => each.charCodeAt(0)),
        new DecompressionStream("deflate"),
      );
  }
  return null;
}

// Of the attributes of the first header: name, type, size, value.
function exrText(bytes) {
  const view = new DataView(bytes.buffer);
  for (let at = 8; bytes[at]; ) {
    const type = bytes.indexOf(0, at) + 1;
    const size = bytes.indexOf(0, type) + 1;
    if (!type || !size || size + 4 > bytes.length) return null;
    const value = size + 4;
    const end = value + view.getInt32(size, true);
    if (end < value) return null;
    if (latin(bytes.subarray(at, type - 1)) === KEY) return bytes.subarray(value, end);
    at = end;
  }
  return null;
}

const begins = (bytes, magic) => magic.every((byte, i) => bytes[i] === byte);

// The recipe in a PNG, WebP or EXR, or null: any other file, and pictures that Sunbox did not make.
export async function readRecipe(file) {
  const magic = new Uint8Array(await file.slice(0, 12).arrayBuffer());
  const isWebp = /^RIFF.{4}WEBP$/s.test(latin(magic));
  if (!begins(magic, PNG) && !begins(magic, EXR) && !isWebp) return null;
  const bytes = new Uint8Array(await file.slice(0, MOST).arrayBuffer());
  try {
    const text = begins(magic, PNG) ? await pngText(bytes) : isWebp ? await webpText(bytes) : exrText(bytes);
    const found = text && JSON.parse(new TextDecoder().decode(text));
    return isObject(found?.scene) && isObject(found.settings) ? found : null;
  } catch {
    return null; // cut off, or somebody else's
  }
}
