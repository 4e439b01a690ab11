// The edge of a shape, from a layer of numbers of one sample a pixel: smooth lines between the pixels, so that it can be
// drawn at any size.

const ROUNDS = 3; // of the blur, each of which reaches a pixel further: the pixels along an edge tell at random
const LEVEL = 0.3; // of the blurred mask, whose edge it follows: a line of one pixel, 0.31 after the blur, has one, too

// Where the sides of a square of four neighbours are crossed, by which corners are inside: bits 1, 2, 4, 8 are the upper
// left, the upper right, the lower right and the lower left one; sides 0 to 3 begin at the upper one, clockwise.
const CROSSED = [
  [],
  [3, 0],
  [0, 1],
  [3, 1],
  [1, 2],
  [3, 0, 1, 2],
  [0, 2],
  [3, 2],
  [2, 3],
  [2, 0],
  [0, 1, 2, 3],
  [2, 1],
  [1, 3],
  [1, 0],
  [0, 3],
  [],
];

// The window of the layer that has the shape with a border: {left, top, width, height, mask}; null where none is seen.
function cut({ floats, width, height }, shape) {
  let [left, top, right, bottom] = [width, height, -1, -1];
  const isIt = (i, j) => Math.round(floats[4 * (j * width + i)]) === shape + 1;
  for (let j = 0; j < height; j += 1) {
    for (let i = 0; i < width; i += 1) {
      if (!isIt(i, j)) continue;
      [left, right] = [Math.min(left, i), Math.max(right, i)];
      [top, bottom] = [Math.min(top, j), Math.max(bottom, j)];
    }
  }
  if (right < 0) return null;
  [left, top, right, bottom] = [left - ROUNDS, top - ROUNDS, right + ROUNDS + 1, bottom + ROUNDS + 1];
  const size = { width: right - left, height: bottom - top };
  const mask = new Float32Array(size.width * size.height);
  for (let j = ROUNDS; j < size.height - ROUNDS; j += 1)
    for (let i = ROUNDS; i < size.width - ROUNDS; i += 1) if (isIt(left + i, top + j)) mask[j * size.width + i] = 1;
  return { left, top, ...size, mask };
}

// Weights 1 2 1 along each direction; what lies beyond the ends is 0.
function blurred(mask, width) {
  const along = (from, step) => from.map((x, at) => ((from[at - step] ?? 0) + 2 * x + (from[at + step] ?? 0)) / 4);
  return along(along(mask, 1), width);
}

// The edge as lines [x0, y0, x1, y1] in pixels of the layer from its upper left corner.
export function contour(layer, shape) {
  const found = cut(layer, shape);
  if (!found) return [];
  const { left, top, width, height } = found;
  let field = found.mask;
  for (let round = 0; round < ROUNDS; round += 1) field = blurred(field, width);
  const lines = [];
  for (let j = 0; j + 1 < height; j += 1) {
    for (let i = 0; i + 1 < width; i += 1) {
      const at = j * width + i;
      const corners = [field[at], field[at + 1], field[at + width + 1], field[at + width]];
      const sides = CROSSED[corners.reduce((bits, x, k) => (x >= LEVEL ? bits | (1 << k) : bits), 0)];
      if (!sides.length) continue;
      const places = sides.map((side) => {
        const [a, b] = [corners[side], corners[(side + 1) % 4]];
        const share = (LEVEL - a) / (b - a);
        const [x, y] = [
          [share, 0],
          [1, share],
          [1 - share, 1],
          [0, 1 - share],
        ][side];
        return [left + i + x + 0.5, top + j + y + 0.5];
      });
      for (let k = 0; k < places.length; k += 2) lines.push([...places[k], ...places[k + 1]]);
    }
  }
  return lines;
}

const LINE = 2; // CSS pixels
const RIM = 4; // of the dark line under it, which shows on any picture

// Draws the edge of a shape onto a canvas that lies over the picture, in as many pixels as the screen has there.
export function drawContour(canvas, layer, shape, color) {
  const { width, height } = layer;
  const zoom = Math.min(canvas.clientWidth / width, canvas.clientHeight / height) * devicePixelRatio || 1;
  Object.assign(canvas, { width: Math.round(width * zoom), height: Math.round(height * zoom) });
  const context = canvas.getContext("2d");
  const path = new Path2D();
  for (const [x0, y0, x1, y1] of contour(layer, shape)) {
    path.moveTo(x0 * zoom, y0 * zoom);
    path.lineTo(x1 * zoom, y1 * zoom);
  }
  context.lineCap = "round";
  for (const [style, wide] of [
    ["rgb(0 0 0 / 60%)", RIM],
    [color, LINE],
  ]) {
    context.strokeStyle = style;
    context.lineWidth = wide * devicePixelRatio;
    context.stroke(path);
  }
}
