// A picture to be shown around: the one on the page over a strip that says what it is, readable on a phone.

const WIDTH = 1080; // pixels at least: what phones show sharply, and what letters are measured by
const STRIP = 0.13; // of the width
const INK = { back: "#1b1b1b", title: "#f4f4f4", note: "#b8b8b8" };

const loaded = (blob) => createImageBitmap(blob);

// The text as far as it fits, with an ellipsis where some is left.
function fitted(context, text, width) {
  if (context.measureText(text).width <= width) return text;
  let end = text.length;
  while (end && context.measureText(`${text.slice(0, end)}…`).width > width) end -= 1;
  return `${text.slice(0, end)}…`;
}

// A PNG of the picture with its strip: the scene's title, its material and where it can be opened.
export async function captioned(picture, { title, note, link }) {
  const image = await loaded(picture);
  const factor = Math.max(1, WIDTH / image.width);
  const width = Math.round(image.width * factor);
  const tall = Math.round(image.height * factor);
  const strip = Math.round(width * STRIP);
  const canvas = new OffscreenCanvas(width, tall + strip);
  const context = canvas.getContext("2d");
  context.imageSmoothingQuality = "high";
  context.fillStyle = INK.back;
  context.fillRect(0, 0, width, tall + strip);
  context.drawImage(image, 0, 0, width, tall);
  image.close();
  const [margin, large, small] = [0.03, 0.036, 0.026].map((share) => Math.round(width * share));
  context.textBaseline = "middle";
  const lines = [
    { text: title, size: large, weight: 600, ink: INK.title, at: 0.36 },
    { text: [note, link].filter(Boolean).join("  ·  "), size: small, weight: 400, ink: INK.note, at: 0.7 },
  ];
  for (const { text, size, weight, ink, at } of lines) {
    context.font = `${weight} ${size}px system-ui, sans-serif`;
    context.fillStyle = ink;
    context.fillText(fitted(context, text, width - 2 * margin), margin, tall + strip * at);
  }
  return canvas.convertToBlob({ type: "image/png" });
}

// Offers a file to the other programs of the device; false where it cannot, or the person did not want it.
export async function offered(file, { title, url }) {
  const what = { files: [file], title, url };
  if (!navigator.canShare?.(what)) return false;
  try {
    await navigator.share(what);
    return true;
  } catch (problem) {
    if (problem.name === "AbortError") return true; // the person thought better of it
    return false;
  }
}
