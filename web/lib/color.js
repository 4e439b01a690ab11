// Colours as the document has them ([r, g, b] linear, a number, "#rrggbb") and as a colour input has them.

export const toSrgb = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
export const toLinear = (x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);

export const HEX = /^#?([0-9a-f]{6})$/i;

const LUMINANCE = [0.2126, 0.7152, 0.0722];

// The colour of a black body of luminance 1, as near as a swatch can show [Krystek 1985].
function planck(t) {
  const u = (0.86012 + 1.5412e-4 * t + 1.2864e-7 * t * t) / (1 + 8.4242e-4 * t + 7.0815e-7 * t * t);
  const v = (0.3174 + 4.2281e-5 * t + 4.2048e-8 * t * t) / (1 - 2.8974e-5 * t + 1.6146e-7 * t * t);
  const [x, z] = [(1.5 * u) / v, (2 - 0.5 * u - 5 * v) / v]; // where y is 1
  const color = [3.24 * x - 1.537 - 0.4985 * z, 1.876 - 0.969 * x + 0.0416 * z, 0.0556 * x - 0.204 + 1.057 * z];
  return ofLuminance(
    color.map((channel) => Math.max(channel, 0)),
    1,
  );
}

function ofLuminance(color, luminance) {
  const own = color.reduce((sum, x, i) => sum + LUMINANCE[i] * x, 0);
  return color.map((x) => (x * luminance) / own);
}

const WORDS = { kelvin: "K", candela: "cd", lumen: "lm", lux: "lx", nit: "nt" };

// What a colour is given by, of WORDS; undefined for plain ones.
const unitOf = (color) => Object.keys(WORDS).find((each) => color?.[each] !== undefined);

// A colour by a temperature or a photometric unit in words: "2700 K", "800 lm"; null for others.
export function measureWords(color) {
  const unit = unitOf(color);
  return unit ? `${color[unit]} ${WORDS[unit]}` : null;
}

// Linear [r, g, b] of any colour that a document may hold; 683 lm are a watt, which goes
// evenly in all directions here.
export function linear(color) {
  if (typeof color === "number") return [color, color, color];
  const unit = unitOf(color);
  if (unit === "kelvin") return planck(color.kelvin);
  if (unit) return ofLuminance(linear(color.color ?? 1), color[unit] / (unit === "lumen" ? 8583 : 683));
  if (typeof color !== "string") return color;
  const bits = parseInt(HEX.exec(color)[1], 16);
  return [bits >> 16, (bits >> 8) & 255, bits & 255].map((byte) => toLinear(byte / 255));
}

// Linear [r, g, b] of a colour as people write it: #rrggbb and #rgb, also without the #, and what CSS knows, such as
// rgb(0 170 255), hsl(200 100% 50%) and names, or as a temperature, 2700 K. Null for others, and for what can be seen
// through.
export function parseColor(text) {
  const plain = text.trim();
  const kelvin = Number(/^(\d{4,5}) ?K$/i.exec(plain)?.[1]);
  if (kelvin >= 1000 && kelvin <= 40000) {
    const warm = planck(kelvin);
    return warm.map((x) => x / Math.max(...warm));
  }
  const wanted = /^([0-9a-f]{3}|[0-9a-f]{6})$/i.test(plain) ? `#${plain}` : plain;
  const context = new OffscreenCanvas(1, 1).getContext("2d");
  const [found, other] = ["#000000", "#ffffff"].map((before) => {
    context.fillStyle = before; // which stays where the words are no colour
    context.fillStyle = wanted;
    return context.fillStyle;
  });
  return found === other && HEX.test(found) ? linear(found) : null;
}

// "#rrggbb" (sRGB) of a linear colour; what does not fit into 0..1 is cut off.
export const hex = (color) =>
  "#" +
  color
    .map((x) =>
      Math.round(255 * toSrgb(Math.min(Math.max(x, 0), 1)))
        .toString(16)
        .padStart(2, "0"),
    )
    .join("");
