// The picture and its document as files, and the command that makes the same picture without this page.

import { readKey } from "./key.js";
import { renderUrl } from "./api.js";
import { writeExr } from "./exr.js";

const CHANNELS = {
  color: ["R", "G", "B", "A"], albedo: ["albedo.R", "albedo.G", "albedo.B"], normal: ["normal.X", "normal.Y", "normal.Z"],
  depth: ["depth.Z"], variance: ["variance.R", "variance.G", "variance.B"], shape_id: ["shape_id.I"], material_id: ["material_id.I"],
};

export async function png(stream, bits) {
  const { header, bytes } = await stream.capture({ format: "png", bits, aov: "color" });
  return { blob: new Blob([bytes], { type: header.mime }), header };
}

// Every layer that the server knows, as they are now: no sample is taken again.
export async function exr(stream, aovs, document) {
  const known = aovs.filter((name) => CHANNELS[name]);
  const layers = [];
  let header = null;
  for (const aov of known) {
    const { header: own, bytes } = await stream.capture({ format: "rgba32f", aov });
    if (header && (own.width !== header.width || own.height !== header.height)) throw new Error("The picture changed on the way.");
    header = own;
    layers.push({ names: CHANNELS[aov], floats: new Float32Array(bytes) });
  }
  return { blob: await writeExr(layers, header.width, header.height, JSON.stringify(document)), header };
}

const quoted = (text) => `'${text.replaceAll("'", "'\\''")}'`;

// With as many samples as are shown: a limit by time or noise would end elsewhere on another machine.
export function exactSettings({ time_limit, target_noise, ...settings }, samples) {
  return { ...settings, max_samples: Math.max(1, samples) };
}

export function curl(scene, settings, { exposure, tone_map }) {
  const url = renderUrl({ format: "png", exposure, tone_map });
  const key = readKey() ? " -H \"Authorization: Bearer $SUNBOX_API_KEY\"" : "";
  return `curl -s ${quoted(url)}${key} -H 'Content-Type: application/json' -o sunbox.png -d ${quoted(JSON.stringify({ scene, settings }))}`;
}
