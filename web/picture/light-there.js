// How much light falls on things in the live picture, and how strong a new light has to be to matter there.

const HALF_STOP = Math.SQRT2 - 1; // of what is there: with it half a stop more
const GREY = 0.18; // the radiance that a new light gives to what was black, at an exposure of 0
const DULL = 0.5 / (2 * Math.PI); // of a grey thing that is half turned away: its radiance over the irradiance
const PATIENCE_MS = 1500;

const luminance = (floats, at) => 0.2126 * floats[at] + 0.7152 * floats[at + 1] + 0.0722 * floats[at + 2];

async function layers(stream) {
  const found = {};
  for (const aov of ["shape_id", "albedo", "normal", "color"]) {
    const view = { format: "rgba32f", quality: null, bits: 8, aov };
    const { header, bytes } = await stream.capture(view, { patience_ms: PATIENCE_MS, rough: true });
    found[aov] = { ...header, floats: new Float32Array(bytes) };
  }
  const { width, height } = found.color;
  const isOne = Object.values(found).every((each) => each.width === width && each.height === height);
  return isOne ? found : null; // a preview, and then a larger picture
}

// The irradiance in W/m² that a light from a direction has to give to make these shapes half a stop brighter. Their mean
// radiance is measured in the picture, and beside it what a light of 1 W/m² adds: albedo times the cosine over pi,
// averaged over what is seen of them.
export async function irradianceFor(stream, shapes, toLight, exposure) {
  const found = await layers(stream).catch(() => null);
  let [there, response] = [0, 0];
  let count = 0;
  const { shape_id: ids, albedo, normal, color } = found ?? {};
  for (let at = 0; at < (color?.floats.length ?? 0); at += 4) {
    const shape = Math.round(ids.floats[at]) - 1;
    if (shape < 0 || (shapes.length && !shapes.includes(shape))) continue;
    const facing = [0, 1, 2].reduce((sum, k) => sum + normal.floats[at + k] * toLight[k], 0);
    there += luminance(color.floats, at);
    response += (luminance(albedo.floats, at) * Math.max(0, facing)) / Math.PI;
    count += 1;
  }
  // What faces away, or is black, says nothing of how it would be lit.
  const perUnit = response > 0.01 * count && count ? response / count : DULL;
  return there > 0 ? (HALF_STOP * there) / count / perUnit : (GREY * 2 ** -exposure) / perUnit;
}
