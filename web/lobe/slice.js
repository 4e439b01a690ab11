// The image slice: the BRDF over the half angle theta_h (to the right) and the difference angle theta_d (upwards) at an
// azimuth of the difference of 90 degrees [Burley 2012, Physically Based Shading at Disney, section 3]. Left is the
// highlight, the top edge is grazing retroreflection's Fresnel rise, the bottom left corner looks back into the light.

import { direction, ofHalf } from "./directions.js";
import { figure, svg, text, tickText } from "./plot.js";
import { toSrgb } from "../lib/color.js";
import { colorTable, luminance, scaleOf, share } from "./values.js";

const ROWS = 36; // angles to the normal
const COLUMNS = 40; // half angles of each
const TOGETHER = 4; // rows of one question: it is answered for all pairs of them, so that fewer waste less
const SIDE = 96; // pixels of the image
const SAME = 1e-3; // relative: what single precision and a table leave of equal values

const thetas = Array.from({ length: ROWS }, (_, i) => ((i + 0.5) / ROWS) * 89.8);

// Half angles that directions at an angle to the normal can have are 0 to that angle; the highlight is near 0.
const halves = (theta) => Array.from({ length: COLUMNS }, (_, j) => theta * (j / (COLUMNS - 1)) ** 2);

// How far two directions at theta are apart in azimuth where their half vector is at thetaH.
export function apartAt(theta, thetaH) {
  const cosine = Math.min(1, Math.tan((thetaH * Math.PI) / 180) / Math.tan((theta * Math.PI) / 180));
  return (2 * Math.acos(cosine) * 180) / Math.PI;
}

// Rows of colours: values[i][j] for thetas[i] and its j-th half angle. The first direction has azimuth 0, as if the
// material looked the same from all sides: a question's directions are paired each with each.
async function first(ask, material) {
  const values = [];
  for (let i = 0; i < ROWS; i += TOGETHER) {
    const block = thetas.slice(i, i + TOGETHER);
    const wi = block.flatMap((theta) => halves(theta).map((half) => direction(theta, apartAt(theta, half))));
    const { f } = await ask("", { material, wo: block.map((theta) => direction(theta, 0)), wi });
    block.forEach((_, k) => values.push(f[k].slice(k * COLUMNS, (k + 1) * COLUMNS)));
  }
  return { values };
}

// Whether two directions see something else when both are turned about the normal.
async function isAnisotropic(ask, material) {
  const turns = [0, 35, 80];
  const { f } = await ask("", {
    material,
    wo: turns.map((turn) => direction(50, turn)),
    wi: turns.map((turn) => direction(40, turn + 150)),
  });
  const [first, ...others] = turns.map((_, i) => luminance(f[i][i]));
  return others.some((value) => Math.abs(value - first) > SAME * first);
}

// With the half vector's azimuth at 0, a question for each row, where the first picture is not already that.
async function finer(ask, material, data, options, round) {
  if (round || !(await isAnisotropic(ask, material))) return null;
  const values = [];
  for (const theta of thetas) {
    const apart = halves(theta).map((half) => apartAt(theta, half) / 2);
    const { f } = await ask("", {
      material,
      wo: apart.map((phi) => direction(theta, -phi)),
      wi: apart.map((phi) => direction(theta, phi)),
    });
    values.push(f.map((row, j) => row[j]));
  }
  return { values };
}

const mix = (a, b, t) => a.map((x, k) => x + t * (b[k] - x));

// The value at (thetaH, thetaD), between the four that are nearest.
export function lookUp(values, thetaH, thetaD) {
  const { theta } = ofHalf(thetaH, thetaD);
  const row = Math.min(Math.max((theta / 89.8) * ROWS - 0.5, 0), ROWS - 1);
  const low = Math.min(Math.floor(row), ROWS - 2);
  const along = (i) => {
    const at = Math.sqrt(Math.min(1, thetaH / thetas[i])) * (COLUMNS - 1);
    const j = Math.min(Math.floor(at), COLUMNS - 2);
    return mix(values[i][j], values[i][j + 1], at - j);
  };
  return mix(along(low), along(low + 1), row - low);
}

const angle = (i) => ((i + 0.5) / SIDE) * 90;

// The image of a variant as a data URL: logarithmic greys by luminance, or the colours themselves, cut off at 1.
function picture({ values }, scale) {
  const canvas = document.createElement("canvas");
  Object.assign(canvas, { width: SIDE, height: SIDE });
  const context = canvas.getContext("2d");
  const image = context.createImageData(SIDE, SIDE);
  for (let y = 0; y < SIDE; y += 1) {
    for (let x = 0; x < SIDE; x += 1) {
      const color = lookUp(values, angle(x), angle(SIDE - 1 - y));
      const shown = scale.decades
        ? Array(3).fill(share(luminance(color), scale))
        : color.map((v) => toSrgb(Math.min(1, Math.max(0, v))));
      const at = 4 * (y * SIDE + x);
      shown.forEach((v, k) => {
        image.data[at + k] = Math.round(255 * Math.min(1, v));
      });
      image.data[at + 3] = 255;
    }
  }
  context.putImageData(image, 0, 0);
  return canvas;
}

const STEP = 10; // degrees between the values of the table
const cells = Array.from({ length: 81 }, (_, k) => [5 + STEP * (k % 9), 5 + STEP * Math.floor(k / 9)]);

// All but the brightest 2 % of the image: towards grazing angles a BRDF may grow without bounds.
const scaleFor = (data, isLog) =>
  scaleOf(
    Object.values(data).flatMap(({ values }) => cells.map(([h, d]) => luminance(lookUp(values, h, d)))),
    isLog,
    0.98,
  );

function draw(data, { isLog, size }) {
  const { width, height } = size;
  const sides = Object.keys(data);
  const scale = scaleFor(data, isLog);
  const room = (width - 40 - 14 * sides.length) / sides.length;
  const side = Math.max(40, Math.min(room, height - 60));
  const left = 38 + (width - 40 - sides.length * (side + 14)) / 2;
  const top = (height - side - 40) / 2 + 14;
  const parts = sides.flatMap((name, i) => {
    const x = left + i * (side + 14);
    const box = svg("foreignObject", { x, y: top, width: side, height: side, class: "pixels" });
    box.append(picture(data[name], scale));
    return [
      box,
      svg("rect", { x, y: top, width: side, height: side, class: "frame" }),
      ...[0, 30, 60, 90].map((at) =>
        text(x + (side * at) / 90, top + side + 14, `${at}°`, {
          "text-anchor": { 0: "start", 90: "end" }[at] ?? "middle",
          class: "ticks",
        }),
      ),
      text(x + side / 2, top + side + 28, "θh, half angle", { "text-anchor": "middle", class: "axis" }),
      sides.length > 1 ? text(x + 5, top - 4, name.toUpperCase(), { class: "axis" }) : null,
    ];
  });
  const words = [0, 30, 60, 90].map((at) =>
    text(left - 5, top + side * (1 - at / 90) + 4, `${at}°`, { "text-anchor": "end", class: "ticks" }),
  );
  const title = svg(
    "text",
    { transform: `translate(${left - 29} ${top + side / 2}) rotate(-90)`, "text-anchor": "middle", class: "axis" },
    "θd, difference angle",
  );
  return figure(width, height, "Image of the BRDF over the half angle and the difference angle", parts, words, title);
}

function note(data, { isLog }) {
  const { most, decades } = scaleFor(data, isLog);
  const shown = isLog
    ? `Luminance of f, from ${tickText(most * 10 ** -decades)} (black) to ${tickText(most)} 1/sr (white).`
    : "f in 1/sr as a colour; 1 and more is white.";
  return `${shown} φd is 90°, the half vector lies over the tangent.`;
}

function table(data) {
  const colors = colorTable(
    data,
    "theta_h_deg",
    cells.map(([h]) => h),
    ({ values }) => cells.map(([h, d]) => lookUp(values, h, d)),
    "f",
  );
  return {
    columns: [colors.columns[0], "theta_d_deg", ...colors.columns.slice(1)],
    rows: colors.rows.map(([h, ...rest], i) => [h, cells[i][1], ...rest]),
  };
}

export const slice = { title: "Slice", needs: "/v1/bsdf", hasLog: true, first, finer, draw, note, table };
