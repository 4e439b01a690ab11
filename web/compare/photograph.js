// A photograph that a picture is compared with. It stays in the page. Its exposure and its white balance are set by hand,
// and multiply linear light.

const LUMINANCE = [0.2126, 0.7152, 0.0722]; // of linear Rec.709

export const NEUTRAL = { exposure: 0, temperature: 0, tint: 0 };

const linearOf = (encoded) => (encoded <= 0.04045 ? encoded / 12.92 : ((encoded + 0.055) / 1.055) ** 2.4);
const encodedOf = (linear) => (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055);

// What red, green and blue are multiplied by. Temperature, in stops, warms: red against blue; tint, in stops, is magenta
// against green. A grey keeps its luminance under both.
export function gainsOf({ exposure, temperature, tint }) {
  const balance = [2 ** (temperature / 2 + tint / 3), 2 ** ((-2 * tint) / 3), 2 ** (-temperature / 2 + tint / 3)];
  const grey = balance.reduce((sum, gain, k) => sum + gain * LUMINANCE[k], 0);
  return balance.map((gain) => (gain * 2 ** exposure) / grey);
}

// The displayed value 0..255 of each displayed value, in light that is multiplied so.
export const curve = (gain) =>
  Uint8ClampedArray.from({ length: 256 }, (_, value) => 255 * encodedOf(Math.min(1, linearOf(value / 255) * gain)));

// The pixels, in place, under {exposure, temperature, tint} in stops.
export function adjusted(image, stops) {
  if (Object.values(stops).every((each) => each === 0)) return image;
  const curves = gainsOf(stops).map(curve);
  const { data } = image;
  for (let i = 0; i < data.length; i += 4) for (let k = 0; k < 3; k += 1) data[i + k] = curves[k][data[i + k]];
  return image;
}

export class Photograph {
  stops = { ...NEUTRAL };
  #bitmap;

  constructor(name, bitmap) {
    this.name = name;
    this.#bitmap = bitmap;
  }

  // Raises why a file cannot be read.
  static async from(file) {
    const bitmap = await createImageBitmap(file).catch(() => {
      throw new Error(`The file ${file.name} could not be read. A photograph is a PNG, JPEG, WebP or AVIF.`);
    });
    return new Photograph(file.name, bitmap);
  }

  close() {
    this.#bitmap.close();
  }

  // Paints it over the whole canvas, cropped evenly where its shape is another.
  paint(canvas) {
    const { width, height } = canvas;
    const context = canvas.getContext("2d", { willReadFrequently: true });
    const zoom = Math.max(width / this.#bitmap.width, height / this.#bitmap.height);
    const [across, down] = [this.#bitmap.width * zoom, this.#bitmap.height * zoom];
    context.fillStyle = "#000"; // behind what is transparent in it
    context.fillRect(0, 0, width, height);
    context.imageSmoothingQuality = "high";
    context.drawImage(this.#bitmap, (width - across) / 2, (height - down) / 2, across, down);
    context.putImageData(adjusted(context.getImageData(0, 0, width, height), this.stops), 0, 0);
  }
}
