// What a picture on the page is to be: its size, its layer, and how its frames come.

import { isAround } from "./camera.js";

// What of a view is a matter of taste; the rest is how the stream carries it.
export const DISPLAY = ["exposure", "tone_map"];

// Whether the screen shows more colours than sRGB has: frames then come in Display P3, and the canvas keeps them so.
export const isWide = matchMedia("(color-gamut: p3)").matches;

// Colour as it is; albedo and normal as the server encodes them; the rest as numbers that are painted here.
const PAINTED = ["depth", "variance", "shape_id", "material_id"];

export const isPainted = (aov) => PAINTED.includes(aov);

// The sides of a final picture, unless somebody says otherwise: stages have room above and below it for tools and state.
export const FINAL = { width: 1920, height: 1080 };

// Of the box, the largest part with these sides' proportions.
export function contained(box, { width, height }) {
  const zoom = Math.min(box.width / width, box.height / height);
  return { width: width * zoom, height: height * zoom };
}

// Whether the picture on the page is as wide as its box, in which the final frame is a part of it; else it has the
// frame's shape. A field of view is that of the height: a wider picture shows more to both sides, and nothing less. A
// panorama shows everything, whatever its shape is.
export const fillsBox = (box, frame, camera) =>
  !isAround(camera) && frame.width * box.height <= box.width * frame.height;

// Pixels that a renderer traces fast enough to follow the hand. What is denoised has use for more than noise has.
export function liveArea({ software }, isDenoised) {
  if (software === false) return 1920 * 1080;
  return isDenoised ? 768 * 768 : 512 * 512;
}

const NEARBY = 16; // pixels less across that a picture may have

// Sides in pixels of a picture that fills the box at the device's ratio, within an area.
export function pictureSize({ width, height }, ratio, area) {
  const wanted = Math.max(1, width * ratio * height * ratio);
  const shrink = ratio * Math.min(1, Math.sqrt(area / wanted));
  const size = (across) => ({
    width: Math.max(16, across),
    height: Math.max(16, Math.round((across * height) / width)),
  });
  const across = Math.round(width * shrink);
  if (shrink === ratio) return size(across);
  // Of the sizes nearby the one whose sides are to each other as the box's: else a line of the stage shows beside it.
  const gap = ({ width: w, height: h }) => Math.abs((w * height) / (h * width) - 1);
  return Array.from({ length: NEARBY }, (_, i) => size(across - i)).reduce((best, each) =>
    gap(each) < gap(best) ? each : best,
  );
}

// How frames are to come for a layer: numbers where the page paints them itself; without a loss where `isExact`, so
// that what is measured between two pictures is not what JPEG did to them.
export function viewOf(ui, view, { isPaused, quality, isExact }) {
  const { layer } = ui;
  const painted = isPainted(layer);
  return {
    ...view,
    lut: view.lut ?? null,
    aov: layer,
    bits: 8,
    color_space: isWide && layer === "color" && !isExact ? "display_p3" : "srgb",
    quality: isPaused ? quality : null,
    format: painted ? "rgba32f" : ui.checkered || isExact ? "png" : "jpeg",
    max_fps: painted ? 4 : isExact ? 8 : null,
    prior: !painted && !isExact,
    denoise: ui.denoised && layer === "color" && !isExact,
  };
}

// The size of the picture that a frame stands for. A preview's own sides tell it to a pixel or so of the preview's; with
// a guess in it, it has full size.
export const fullSize = ({ width, height, scale, prior }) =>
  prior ? { width, height } : { width: Math.round(width / scale), height: Math.round(height / scale) };
