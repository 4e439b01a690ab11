// Files as a zip, stored and not compressed: images are compressed already.

const TABLE = Uint32Array.from({ length: 256 }, (_, n) => {
  let c = n;
  for (let k = 0; k < 8; k += 1) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
  return c >>> 0;
});

function crc32(bytes) {
  let c = 0xffffffff;
  for (const byte of bytes) c = TABLE[(c ^ byte) & 0xff] ^ (c >>> 8);
  return (c ^ 0xffffffff) >>> 0;
}

// Little-endian numbers: [size in bytes, value].
function packed(...numbers) {
  const out = new DataView(new ArrayBuffer(numbers.reduce((sum, [size]) => sum + size, 0)));
  let at = 0;
  for (const [size, value] of numbers) {
    if (size === 2) out.setUint16(at, value, true);
    else out.setUint32(at, value, true);
    at += size;
  }
  return new Uint8Array(out.buffer);
}

const VERSION = 20;
const UTF8 = 0x0800; // of names
const DAY = 0x21; // 1980-01-01: the same files always make the same zip

// A zip of the files [{name, arrayBuffer()}], as a File of that name.
export async function zip(files, name) {
  const parts = [];
  const directory = [];
  let end = 0;
  for (const file of files) {
    const bytes = new Uint8Array(await file.arrayBuffer());
    const title = new TextEncoder().encode(file.name);
    const size = bytes.length;
    const common = [
      [2, VERSION],
      [2, UTF8],
      [2, 0],
      [2, 0],
      [2, DAY],
      [4, crc32(bytes)],
      [4, size],
      [4, size],
    ];
    const header = packed([4, 0x04034b50], ...common, [2, title.length], [2, 0]);
    const zeros = [
      [2, 0],
      [2, 0],
      [2, 0],
      [2, 0],
      [4, 0],
    ];
    directory.push(packed([4, 0x02014b50], [2, VERSION], ...common, [2, title.length], ...zeros, [4, end]), title);
    parts.push(header, title, bytes);
    end += header.length + title.length + size;
  }
  const length = directory.reduce((sum, part) => sum + part.length, 0);
  const count = files.length;
  const foot = packed([4, 0x06054b50], [2, 0], [2, 0], [2, count], [2, count], [4, length], [4, end], [2, 0]);
  return new File([...parts, ...directory, foot], name, { type: "application/zip" });
}
