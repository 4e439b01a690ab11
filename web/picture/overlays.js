// What can be laid over the picture: the legend of a layer; and where that lies.

import { element } from "../lib/dom.js";

export function showLegend(root, legend) {
  root.hidden = !legend;
  if (!legend) return;
  const parts = [];
  if (legend.ramp) {
    const bar = element("span", { class: "ramp" });
    bar.style.setProperty("background", `linear-gradient(to right, ${legend.ramp.join(", ")})`);
    parts.push(element("span", {}, legend.low), bar, element("span", {}, legend.high));
  }
  for (const { color, text } of legend.swatches ?? []) {
    const dot = element("i", {});
    dot.style.setProperty("background", color);
    parts.push(element("span", { class: "key" }, dot, text));
  }
  if (legend.note) parts.push(element("span", { class: "dim" }, legend.note));
  root.replaceChildren(...parts);
}

// Has an element lie over the picture, not over the stage around it. The height of the picture in CSS pixels comes back.
export function fitOverlay(overlay, stage, canvas) {
  const zoom = Math.min(stage.clientWidth / canvas.width, stage.clientHeight / canvas.height);
  const [w, h] = [canvas.width * zoom, canvas.height * zoom];
  const style = { width: w, height: h, left: (stage.clientWidth - w) / 2, top: (stage.clientHeight - h) / 2 };
  for (const [name, value] of Object.entries(style)) overlay.style.setProperty(name, `${value}px`);
  return h;
}
