// An environment as a mirror ball shows it: rendered once by the service, for its picture and for where it is brightest.

import { project, ray } from "../document/camera.js";
import { mirrored } from "../document/highlights.js";
import { toSrgb } from "../lib/color.js";
import { fetchPreset, renderValues } from "../server/api.js";
import { add, dot, normalize, scale, turn } from "../lib/vector.js";

const SIDE = 96;
const SETTINGS = { width: SIDE, height: SIDE, max_samples: 16, max_bounces: 2, seed: 1 };
const CAMERA = { position: [0, 0, 12], target: [0, 0, 0], up: [0, 1, 0], vfov: 9.6 };
const MIRROR = "chrome"; // of the library
const BRIGHT = 0.5; // of the greatest luminance: what belongs to the brightest place
const NEAR = Math.cos(Math.PI / 6); // of the angle to it
const GREY = 0.25; // what the mean of a picture is shown as

// What the document is at rotation 0 and a strength of 1: only another one of these is rendered anew.
const unturned = ({ rotation: _, scale: __, ...environment }) => environment;

const sceneOf = (environment, mirror) => ({
  version: 1,
  camera: CAMERA,
  environment,
  materials: { mirror },
  shapes: [{ type: "sphere", center: [0, 0, 0], radius: 1, material: "mirror" }],
});

// The direction that the ball mirrors at a pixel, or null beside it.
function seenAt(i, j) {
  const way = ray(CAMERA, (i + 0.5) / SIDE, (j + 0.5) / SIDE, 1);
  const middle = -dot(CAMERA.position, way);
  const square = middle * middle - dot(CAMERA.position, CAMERA.position) + 1;
  if (square < 0) return null;
  return mirrored(way, add(CAMERA.position, scale(way, middle - Math.sqrt(square))));
}

// The directions of the ball's pixels: [{at, way}] with `at` the pixel's number.
const WAYS = Array.from({ length: SIDE * SIDE }, (_, at) => ({
  at,
  way: seenAt(at % SIDE, Math.floor(at / SIDE)),
})).filter(({ way }) => way);

const turnedRound = ([x, y, z]) => [-x, y, -z];

// The pixel of two balls, the front's and the back's, that shows a direction of the environment best: {side, at}.
function pixelOf(own) {
  const side = own[2] < 0 ? 1 : 0;
  const [x, y, z] = side ? turnedRound(own) : own;
  const place = project(CAMERA, normalize([x, y, z + 1]), 1);
  return { side, at: Math.floor(place.y * SIDE) * SIDE + Math.floor(place.x * SIDE) };
}

const luminance = (floats, at) => 0.2126 * floats[at] + 0.7152 * floats[at + 1] + 0.0722 * floats[at + 2];

// {floats, channels} of a .npy file of single-precision numbers (height, width, channels).
function parsed(file) {
  const floats = new Float32Array(file.slice(10 + new DataView(file).getUint16(8, true)));
  return { floats, channels: floats.length / SIDE ** 2 };
}

// The unit direction in which an environment is brightest, or null where it is black, or the same all around.
export function brightestOf(balls) {
  const pixels = balls.flatMap(({ floats, channels }, side) =>
    WAYS.filter(({ way }) => way[2] >= 0).map(({ at, way }) => ({
      way: side ? turnedRound(way) : way,
      light: luminance(floats, channels * at),
    })),
  );
  const best = pixels.reduce((a, b) => (b.light > a.light ? b : a));
  const least = pixels.reduce((a, b) => (b.light < a.light ? b : a));
  if (!(best.light > 1.01 * least.light)) return null;
  const around = pixels.filter(({ way, light }) => light >= BRIGHT * best.light && dot(way, best.way) > NEAR);
  return normalize(around.reduce((sum, { way, light }) => add(sum, scale(way, light)), [0, 0, 0]));
}

let kept = { text: null, balls: null };

// Resolves to the pictures of an environment at rotation 0 on two balls, {floats, channels} each, linear: seen from +Z and,
// turned half round, from -Z. What lies behind the one is at its very edge, and large on the other.
export function ballsOf(environment) {
  const own = unturned({ ...environment, background: true });
  const text = JSON.stringify(own);
  if (kept.text !== text) {
    const balls = fetchPreset("materials", MIRROR).then((mirror) =>
      Promise.all(
        [0, 180].map((rotation) => renderValues(sceneOf({ ...own, rotation }, mirror), SETTINGS).then(parsed)),
      ),
    );
    kept = { text, balls };
    balls.catch(() => {
      if (kept.balls === balls) kept = { text: null, balls: null };
    });
  }
  return kept.balls;
}

// Draws onto a canvas of any size the ball as it mirrors the environment, turned by degrees.
export function drawBall(canvas, balls, degrees) {
  Object.assign(canvas, { width: SIDE, height: SIDE });
  const image = new ImageData(SIDE, SIDE);
  const mean =
    WAYS.reduce((sum, { at }) => sum + luminance(balls[0].floats, balls[0].channels * at), 0) / WAYS.length || 1;
  for (const { at, way } of WAYS) {
    const { side, at: from } = pixelOf(turn(way, [0, 1, 0], (-degrees * Math.PI) / 180));
    const { floats, channels } = balls[side];
    for (let k = 0; k < 3; k += 1)
      image.data[4 * at + k] = 255 * toSrgb(Math.min(1, (GREY * floats[channels * from + k]) / mean));
    image.data[4 * at + 3] = 255;
  }
  canvas.getContext("2d").putImageData(image, 0, 0);
}
