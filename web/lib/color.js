// Colours as the document has them ([r, g, b] linear, a number, "#rrggbb") and as a colour input has them.

export const toSrgb = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
export const toLinear = (x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);

export const HEX = /^#?([0-9a-f]{6})$/i;

// Linear [r, g, b] of any colour that a document may hold.
export function linear(color) {
  if (typeof color === "number") return [color, color, color];
  if (typeof color !== "string") return color;
  const bits = parseInt(HEX.exec(color)[1], 16);
  return [bits >> 16, (bits >> 8) & 255, bits & 255].map((byte) => toLinear(byte / 255));
}

// Linear [r, g, b] of a colour as people write it: #rrggbb and #rgb, also without the #, and what CSS knows, such as
// rgb(0 170 255), hsl(200 100% 50%) and names. Null for others, and for what can be seen through.
export function parseColor(text) {
  const plain = text.trim();
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
