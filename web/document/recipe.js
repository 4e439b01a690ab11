// What a picture was made from, inside the picture: the same metadata that the server and the command line write into
// PNG, WebP and EXR files, {sunbox, scene, settings, samples, view}, under the key "sunbox".

import { equal } from "../lib/patch.js";

export const KEY = "sunbox";
const LONG_TEXT = 4096; // what image viewers still show whole: a longer text is deflated
export const MOST = 64 << 20; // bytes of a file, or of an inflated text, that are looked at
export const PNG = [0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a];
const PNG_HEADER = 33; // magic and IHDR

const CRC = Uint32Array.from({ length: 256 }, (_, n) => {
  let c = n;
  for (let k = 0; k < 8; k += 1) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
  return c;
});
const crc32 = (bytes) =>
  (bytes.reduce((c, byte) => CRC[(c ^ byte) & 255] ^ (c >>> 8), 0xffffffff) ^ 0xffffffff) >>> 0;

export const latin = (bytes) => new TextDecoder("latin1").decode(bytes);
export const ascii = (text) => new TextEncoder().encode(text);

// JSON in ASCII: what is beyond it is escaped, for PNG's text chunks are Latin-1.
export const recipeText = (recipe) =>
  JSON.stringify(recipe).replaceAll(
    /[\u0080-\uffff]/g,
    (character) => `\\u${character.charCodeAt(0).toString(16).padStart(4, "0")}`,
  );

export async function through(bytes, transform) {
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

// The members of a document that are not what they would be anyhow.
export const givenOf = (values, base) =>
  Object.fromEntries(Object.entries(values).filter(([name, value]) => value !== null && !equal(value, base[name])));
