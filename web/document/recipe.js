// What a picture was made from, inside the picture: the same metadata that the server and the command line write into
// PNG, WebP and EXR files, {sunbox, scene, settings, samples, view}, under the key "sunbox".

import { equal, isObject } from "../lib/patch.js";

export const KEY = "sunbox";
const LONG_TEXT = 4096; // what image viewers still show whole: a longer text is deflated
const MOST = 64 << 20; // bytes of a file, or of an inflated text, that are looked at
const PNG = [0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a];
const EXR = [0x76, 0x2f, 0x31, 0x01];
const PNG_HEADER = 33; // magic and IHDR

const CRC = Uint32Array.from({ length: 256 }, (_, n) => {
  let c = n;
  for (let k = 0; k < 8; k += 1) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
  return c;
});
const crc32 = (bytes) =>
  (bytes.reduce((c, byte) => CRC[(c ^ byte) & 255] ^ (c >>> 8), 0xffffffff) ^ 0xffffffff) >>> 0;

const latin = (bytes) => new TextDecoder("latin1").decode(bytes);
const ascii = (text) => new TextEncoder().encode(text);

// JSON in ASCII: what is beyond it is escaped, for PNG's text chunks are Latin-1.
export const recipeText = (recipe) =>
  JSON.stringify(recipe).replaceAll(
    /[\u0080-\uffff]/g,
    (character) => `\\u${character.charCodeAt(0).toString(16).padStart(4, "0")}`,
  );

async function through(bytes, transform) {
  const parts = [];
  let size = 0;
  for await (const part of new Blob([bytes]).stream().pipeThrough(transform)) {
    parts.push(part);
    if ((size += part.length) > MOST) return null; // a few kilobytes can claim gigabytes
  }
  return new Uint8Array(await new Blob(parts).arrayBuffer());
}

// The PNG with its recipe in a text chunk after the header.
export async function pngWith(png, recipe) {
  const text = ascii(recipeText(recipe));
  const body =
    text.length > LONG_TEXT
      ? [ascii(`zTXt${KEY}\0\0`), await through(text, new CompressionStream("deflate"))]
      : [ascii(`tEXt${KEY}\0`), text];
  const chunk = new Uint8Array(await new Blob(body).arrayBuffer());
  const ends = [new DataView(new ArrayBuffer(4)), new DataView(new ArrayBuffer(4))];
  ends[0].setUint32(0, chunk.length - 4);
  ends[1].setUint32(0, crc32(chunk));
  return new Blob([png.slice(0, PNG_HEADER), ends[0], chunk, ends[1], png.slice(PNG_HEADER)], { type: "image/png" });
}

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

// The members of a document that are not what they would be anyhow.
export const givenOf = (values, base) =>
  Object.fromEntries(Object.entries(values).filter(([name, value]) => value !== null && !equal(value, base[name])));

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
