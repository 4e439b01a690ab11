// What is counted of the picture's colours and laid over it: a histogram, and clipped pixels.

import { element } from "../lib/dom.js";
import { percent } from "../lib/format-text.js";

const RED = [255, 60, 60];
const BLUE = [60, 110, 255];

// Counts of 256 values for red, green and blue.
export function countValues({ data }) {
  const counts = [0, 1, 2].map(() => new Uint32Array(256));
  for (let i = 0; i < data.length; i += 4) for (let k = 0; k < 3; k += 1) counts[k][data[i + k]] += 1;
  return counts;
}

export function drawHistogram(canvas, image) {
  const context = canvas.getContext("2d");
  const { width, height } = canvas;
  const counts = countValues(image);
  // Black and white heap up at the ends: what lies between sets the scale.
  const most = Math.max(1, ...counts.flatMap((each) => [...each.slice(1, 255)]));
  context.clearRect(0, 0, width, height);
  context.globalCompositeOperation = "lighter";
  counts.forEach((each, k) => {
    context.fillStyle = ["#c03030", "#2f9a3f", "#3a5fd0"][k];
    each.forEach((n, i) => {
      const tall = Math.min(1, Math.sqrt(n / most)) * height;
      context.fillRect((i * width) / 256, height - tall, width / 256, tall);
    });
  });
  context.globalCompositeOperation = "source-over";
}

// Red where a channel is at its end, blue where all are black. The share of each is returned.
export function drawClipping(canvas, image) {
  const { width, height, data } = image;
  const over = new ImageData(width, height);
  let [high, low] = [0, 0];
  for (let i = 0; i < data.length; i += 4) {
    const isHigh = data[i] >= 254 || data[i + 1] >= 254 || data[i + 2] >= 254;
    const isLow = data[i] <= 1 && data[i + 1] <= 1 && data[i + 2] <= 1;
    if (!isHigh && !isLow) continue;
    if (isHigh) high += 1;
    else low += 1;
    over.data.set([...(isHigh ? RED : BLUE), 255], i);
  }
  Object.assign(canvas, { width, height });
  canvas.getContext("2d").putImageData(over, 0, 0);
  return { high: high / (width * height), low: low / (width * height) };
}

// What the two colours over the picture stand for, with the shares of it that they cover.
export function showClipped(root, { high, low }) {
  const key = ([color, text]) => {
    const dot = element("i", {});
    dot.style.setProperty("background", `rgb(${color.join(" ")})`);
    return element("span", { class: "key" }, dot, text);
  };
  root.replaceChildren(
    ...[
      [RED, `Clipped ${percent(high)}`],
      [BLUE, `Black ${percent(low)}`],
    ].map(key),
  );
}
