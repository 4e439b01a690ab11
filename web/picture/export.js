// The picture and its document as files, and the command that makes the same picture without this page.

import { readKey } from "../server/key.js";
import { renderUrl } from "../server/api.js";
import { KEY, pngWith, recipeText } from "../document/recipe.js";

const CHANNELS = {
  color: ["R", "G", "B", "A"],
  albedo: ["albedo.R", "albedo.G", "albedo.B"],
  normal: ["normal.X", "normal.Y", "normal.Z"],
  depth: ["depth.Z"],
  variance: ["variance.R", "variance.G", "variance.B"],
  shape_id: ["shape_id.I"],
  material_id: ["material_id.I"],
  incidence: ["incidence.I"],
};

// `madeFrom(scene, samples, {aov, bits})` gives the metadata of a picture.
export async function png(stream, bits, madeFrom) {
  const { header, bytes, scene } = await stream.capture({ format: "png", bits, aov: "color" });
  return { blob: await pngWith(bytes, madeFrom(scene, header.samples, { aov: "color", bits })), header };
}

// Every layer that the server knows, as they are now: no sample is taken again.
export async function exr(stream, aovs, madeFrom) {
  const known = aovs.filter((name) => CHANNELS[name]);
  const layers = [];
  let header = null;
  let scene = null;
  for (const aov of known) {
    const { header: own, bytes, scene: shown } = await stream.capture({ format: "rgba32f", aov });
    if (header && own.generation !== header.generation) throw new Error("The picture changed on the way. Try again.");
    [header, scene] = [own, shown];
    layers.push({ names: CHANNELS[aov], floats: new Float32Array(bytes) });
  }
  const { writeExr } = await import("./exr.js"); // few want one
  return {
    blob: await writeExr(layers, header.width, header.height, {
      [KEY]: recipeText(madeFrom(scene, header.samples, { aov: "all" })),
    }),
    header,
  };
}

const quoted = (text) => `'${text.replaceAll("'", "'\\''")}'`;

// With as many samples as are shown: a limit by time or noise would end elsewhere on another machine.
export function exactSettings({ time_limit, target_noise, ...settings }, samples) {
  return { ...settings, max_samples: Math.max(1, samples) };
}

export function curl(scene, settings, { exposure, tone_map, lut }) {
  const url = renderUrl({ format: "png", exposure, tone_map, ...(lut && { lut }) });
  const key = readKey() ? ' -H "Authorization: Bearer $SUNBOX_API_KEY"' : "";
  return `curl -s ${quoted(url)}${key} -H 'Content-Type: application/json' -o sunbox.png -d ${quoted(JSON.stringify({ scene, settings }))}`;
}
