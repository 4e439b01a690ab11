// What lies between two pictures of one size, pixel by pixel, in the colours as they are displayed.

const GREY = 128; // what no difference is drawn as where it has a sign

// How a difference is drawn, per channel, from `second - first` in 0..255 times the gain.
const DRAWN = {
  absolute: (step) => Math.abs(step),
  signed: (step) => GREY + step,
};

// {rmse, psnr, most} in displayed values of 0..1. Into `out` go the differences times `gain`, "absolute" or "signed"; or,
// as "heat", the largest of a pixel's channels from black over red and yellow to white. Columns outside of `span`, which
// one of the pictures does not have, stay empty and do not count.
export function difference(first, second, out = null, { gain = 1, drawn = "absolute", span = null } = {}) {
  const { width, height } = first;
  const [from, to] = span ?? [0, width];
  const isHeat = drawn === "heat";
  const draw = DRAWN[drawn];
  let sum = 0;
  let most = 0;
  for (let y = 0; y < height; y += 1)
    for (let i = 4 * (y * width + from); i < 4 * (y * width + to); i += 4) {
      let largest = 0;
      for (let k = 0; k < 3; k += 1) {
        const step = second.data[i + k] - first.data[i + k];
        sum += step * step;
        largest = Math.max(largest, Math.abs(step));
        if (out && !isHeat) out.data[i + k] = draw(step * gain);
      }
      most = Math.max(most, largest);
      if (!out) continue;
      if (isHeat) for (let k = 0; k < 3; k += 1) out.data[i + k] = 3 * largest * gain - 255 * k;
      out.data[i + 3] = 255;
    }
  const rmse = Math.sqrt(sum / Math.max(1, 3 * (to - from) * height)) / 255;
  return { rmse, psnr: rmse > 0 ? -20 * Math.log10(rmse) : Infinity, most: most / 255 };
}
