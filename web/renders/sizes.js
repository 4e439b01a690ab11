// The sizes of a picture that have names, and shapes that keep their proportions.

import { FINAL } from "../document/picture-view.js";

export const WINDOW = "window";
export const CUSTOM = "custom";

export const SIZES = {
  hd: { title: "HD", ...FINAL },
  "4k": { title: "4K", width: 3840, height: 2160 },
  square: { title: "Square", width: 1080, height: 1080 },
  story: { title: "Story", width: 1080, height: 1920 },
};
export const SHAPES = ["16:9", "3:2", "4:3", "5:4", "4:5", "2:3"];

export const times = (width, height) => `${width}\u202f×\u202f${height}`;

const ratioOf = (shape) => shape.split(":").reduce((a, b) => Number(a) / Number(b));
const across = (shape, height) => Math.max(1, Math.round(height * ratioOf(shape)));
const down = (shape, width) => Math.max(1, Math.round(width / ratioOf(shape)));

export const STANDARD = "hd"; // unless somebody says otherwise

// The size that a choice stands for, beside the one that is there and that of the window.
export function sizeOf(choice, present, screen) {
  if (choice === WINDOW) return screen;
  if (SIZES[choice]) return { width: SIZES[choice].width, height: SIZES[choice].height };
  if (SHAPES.includes(choice)) return { width: present.width, height: down(choice, present.width) };
  return present;
}

// The size once one side was written: of a shape the other side follows.
export function withSide(choice, present, name, value) {
  const size = { ...present, [name]: value };
  if (!SHAPES.includes(choice)) return size;
  return name === "width" ? { ...size, height: down(choice, value) } : { ...size, width: across(choice, value) };
}

// What a size is called: a shape stays chosen while the size has its proportions, the window's while it has its size.
export function choiceOf(size, chosen, screen) {
  const { width, height } = size;
  if (chosen === WINDOW && width === screen?.width && height === screen?.height) return WINDOW;
  if (SHAPES.includes(chosen) && (height === down(chosen, width) || width === across(chosen, height))) return chosen;
  const named = Object.entries(SIZES).find(([, each]) => each.width === width && each.height === height);
  return named?.[0] ?? CUSTOM;
}
