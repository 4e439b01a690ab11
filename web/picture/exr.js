// OpenEXR files with float channels in layers, compressed by ZIP in blocks of sixteen lines. From the file
// layout document of the Academy Software Foundation.

const ROWS = 16;
const ZIP = 3;
const FLOAT = 2;

const text = (value) => [...new TextEncoder().encode(value), 0];

function int32(...values) {
  return [...new Uint8Array(new Int32Array(values).buffer)];
}

const float32 = (...values) => [...new Uint8Array(new Float32Array(values).buffer)];

function attribute(name, type, bytes) {
  return [...text(name), ...text(type), ...int32(bytes.length), ...bytes];
}

function header(channels, width, height, texts) {
  const box = int32(0, 0, width - 1, height - 1);
  const list = [...channels.flatMap(({ name }) => [...text(name), ...int32(FLOAT), 0, 0, 0, 0, ...int32(1, 1)]), 0];
  const note = (value) => [...new TextEncoder().encode(value)];
  return [
    ...int32(20000630, 2),
    ...attribute("channels", "chlist", list),
    ...Object.entries(texts).flatMap(([name, value]) => attribute(name, "string", note(value))),
    ...attribute("compression", "compression", [ZIP]),
    ...attribute("dataWindow", "box2i", box),
    ...attribute("displayWindow", "box2i", box),
    ...attribute("lineOrder", "lineOrder", [0]),
    ...attribute("pixelAspectRatio", "float", float32(1)),
    ...attribute("screenWindowCenter", "v2f", float32(0, 0)),
    ...attribute("screenWindowWidth", "float", float32(1)),
    0,
  ];
}

// Even bytes, then odd ones, each as the step from the one before: floats compress so.
function predicted(raw) {
  const half = Math.ceil(raw.length / 2);
  const sorted = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i += 1) sorted[(i >> 1) + (i & 1 ? half : 0)] = raw[i];
  const out = new Uint8Array(raw.length);
  out[0] = sorted[0];
  for (let i = 1; i < raw.length; i += 1) out[i] = (sorted[i] - sorted[i - 1] + 384) & 255;
  return out;
}

async function deflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new CompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// `layers`: [{names: ["R", "G", "B", "A"], floats}] with four floats a pixel, row 0 at the top; `texts` become
// attributes; a Blob.
export async function writeExr(layers, width, height, texts) {
  const channels = layers
    .flatMap(({ names, floats }) => names.map((name, offset) => ({ name, floats, offset })))
    .sort((a, b) => (a.name < b.name ? -1 : 1));
  const blocks = [];
  for (let top = 0; top < height; top += ROWS) {
    const rows = Math.min(ROWS, height - top);
    const values = new Float32Array(rows * channels.length * width);
    let at = 0;
    for (let y = top; y < top + rows; y += 1) {
      for (const { floats, offset } of channels) {
        for (let x = 0; x < width; x += 1) values[at++] = floats[4 * (y * width + x) + offset];
      }
    }
    const raw = new Uint8Array(values.buffer);
    const packed = await deflated(predicted(raw));
    blocks.push({ top, bytes: packed.length < raw.length ? packed : raw }); // what does not shrink stays as it is
  }
  const head = new Uint8Array(header(channels, width, height, texts));
  const offsets = new BigUint64Array(blocks.length);
  let place = head.length + 8 * blocks.length;
  blocks.forEach(({ bytes }, i) => {
    offsets[i] = BigInt(place);
    place += 8 + bytes.length;
  });
  const parts = blocks.flatMap(({ top, bytes }) => [new Int32Array([top, bytes.length]), bytes]);
  return new Blob([head, offsets, ...parts], { type: "image/x-exr" });
}
