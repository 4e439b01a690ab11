// An environment as a mirror ball shows it: rendered once by the service, for its picture and for where it is brightest.

import { ray } from "../document/camera.js";
import { mirrored } from "../document/highlights.js";
import { fetchPreset, renderValues } from "../server/api.js";
import { add, dot, normalize, scale } from "../lib/vector.js";

const SIDE = 96;
const SETTINGS = { width: SIDE, height: SIDE, max_samples: 16, max_bounces: 2, seed: 1 };
const CAMERA = { position: [0, 0, 12], target: [0, 0, 0], up: [0, 1, 0], vfov: 9.6 };
const BRIGHT = 0.5; // of the greatest luminance: what belongs to the brightest place
const NEAR = Math.cos(Math.PI / 6); // of the angle to it

// What the document is at rotation 0 and a strength of 1: only another one of these is rendered anew.
const unturned = ({ rotation: _, scale: __, ...environment }) => environment;

const MIRROR = "chrome"; // of the library
const sceneOf = (environment, mirror) => ({
  version: 1,
  camera: CAMERA,
  environment,
  materials: { mirror },
  shapes: [{ type: "sphere", center: [0, 0, 0], radius: 1, material: "mirror" }],
});

// The direction that the ball mirrors at a pixel, or null beside it.
export function seenAt(i, j) {
  const way = ray(CAMERA, (i + 0.5) / SIDE, (j + 0.5) / SIDE, 1);
  const middle = -dot(CAMERA.position, way);
  const square = middle * middle - dot(CAMERA.position, CAMERA.position) + 1;
  if (square < 0) return null;
  const point = add(CAMERA.position, scale(way, middle - Math.sqrt(square)));
  return mirrored(way, point);
}

const luminance = (floats, at) => 0.2126 * floats[at] + 0.7152 * floats[at + 1] + 0.0722 * floats[at + 2];

// {floats, channels} of a .npy file of single-precision numbers (height, width, channels).
function parsed(file) {
  const view = new DataView(file);
  const start = 10 + view.getUint16(8, true);
  const floats = new Float32Array(file.slice(start));
  return { floats, channels: floats.length / SIDE ** 2 };
}

// The unit direction in which a ball's picture is brightest, or null where it is black, or the same all around.
export function brightestOf({ floats, channels }) {
  const pixels = [];
  for (let j = 0; j < SIDE; j += 1) {
    for (let i = 0; i < SIDE; i += 1) {
      const way = seenAt(i, j);
      if (way) pixels.push({ way, light: luminance(floats, channels * (j * SIDE + i)) });
    }
  }
  const best = pixels.reduce((a, b) => (b.light > a.light ? b : a));
  const least = pixels.reduce((a, b) => (b.light < a.light ? b : a));
  if (!(best.light > 1.01 * least.light)) return null;
  const around = pixels.filter(({ way, light }) => light >= BRIGHT * best.light && dot(way, best.way) > NEAR);
  return normalize(around.reduce((sum, { way, light }) => add(sum, scale(way, light)), [0, 0, 0]));
}

let kept = { text: null, ball: null };

// Resolves to the ball {floats, channels} of an environment, linear and at rotation 0.
export function ballOf(environment) {
  const own = unturned(environment);
  const text = JSON.stringify(own);
  if (kept.text !== text) {
    const ball = fetchPreset("materials", MIRROR)
      .then((mirror) => renderValues(sceneOf(own, mirror), SETTINGS))
      .then(parsed);
    kept = { text, ball };
    ball.catch(() => {
      if (kept.ball === ball) kept = { text: null, ball: null };
    });
  }
  return kept.ball;
}
