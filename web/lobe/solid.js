// The lobe in space: a mesh over the directions of the sphere, each vertex as far from the origin as the BSDF's value
// is large. Drawn as polygons from back to front, seen from a camera that turns about the normal.

import { inPlane, direction, meshAngles } from "./directions.js";
import { figure, path, svg, text, tickText } from "./plot.js";
import { hex } from "../lib/color.js";
import { luminance, scaleOf, share } from "./values.js";
import { cross, dot, length, normalize, scale, subtract } from "../lib/vector.js";

const LIGHT = normalize([0.3, -0.5, 0.8]); // in the camera's space: right, up, towards
const AMBIENT = 0.45;

const mirrored = ([x, y, z]) => [x, y, -z];

async function first(ask, material, { incidence }) {
  const { thetas, phis } = meshAngles(Math.min(incidence, 180 - incidence));
  const upper = [[0, 0, 1], ...thetas.flatMap((theta) => phis.map((phi) => direction(theta, phi)))];
  const { f } = await ask("", { material, wo: upper, wi: [inPlane(-incidence)] });
  return {
    incidence,
    thetas: thetas.length,
    phis: phis.length,
    directions: upper,
    upper: f.map(([color]) => color),
    lower: null,
  };
}

// The half below the surface comes second: most materials have nothing there.
async function finer(ask, material, data) {
  if (data.lower) return null;
  const { f } = await ask("", { material, wo: data.directions.map(mirrored), wi: [inPlane(-data.incidence)] });
  const lower = f.map(([color]) => color);
  return { ...data, lower: lower.some((color) => Math.max(...color) > 0) ? lower : [] };
}

const goesThrough = (data) => Object.values(data).some(({ lower }) => lower?.length);

// The faces of a half of the sphere as indices: triangles at the pole, quads elsewhere.
export function faces(thetas, phis) {
  const at = (ring, spoke) => 1 + ring * phis + (spoke % phis);
  const cap = Array.from({ length: phis }, (_, i) => [0, at(0, i), at(0, i + 1)]);
  const bands = Array.from({ length: (thetas - 1) * phis }, (_, k) => {
    const [ring, i] = [Math.floor(k / phis), k % phis];
    return [at(ring, i), at(ring + 1, i), at(ring + 1, i + 1), at(ring, i + 1)];
  });
  return [...cap, ...bands];
}

// The camera: its axes in the frame of the surface, for a turn about the normal and a height above the surface.
export function axes(turn, height) {
  const [ct, st, ch, sh] = [Math.cos(turn), Math.sin(turn), Math.cos(height), Math.sin(height)];
  return { right: [ct, st, 0], up: [st * sh, -ct * sh, ch], towards: [st * ch, -ct * ch, sh] };
}

const into = (view) => (p) => [dot(p, view.right), dot(p, view.up), dot(p, view.towards)];

// The polygons of one half: [{points, depth, color}] in the camera's space.
function half(own, values, isLower, scaled, camera) {
  const points = own.directions.map((d, i) =>
    camera(scale(isLower ? mirrored(d) : d, share(luminance(values[i]), scaled))),
  );
  return faces(own.thetas, own.phis)
    .flatMap((face) => {
      const corners = face.map((i) => points[i]);
      const across = cross(subtract(corners[2], corners[0]), subtract(corners[1], corners.at(-1)));
      if (!(length(across) > 1e-9)) return [];
      const lit = AMBIENT + (1 - AMBIENT) * Math.abs(dot(normalize(across), LIGHT));
      const color = values[face[0]].map((_, k) => face.reduce((sum, i) => sum + values[i][k], 0));
      const strongest = Math.max(...color, 1e-30);
      return [
        {
          points: corners,
          depth: corners.reduce((sum, [, , z]) => sum + z, 0) / corners.length,
          color: hex(color.map((x) => 0.75 * lit * (x / strongest))),
        },
      ];
    })
    .sort((a, b) => a.depth - b.depth);
}

function draw(data, { isLog, size, turn, height, incidence }) {
  const { width, height: high } = size;
  const isWhole = goesThrough(data) || incidence > 90;
  const radius = Math.max(20, Math.min(width / 2 - 16, isWhole ? high / 2 - 14 : high * 0.62));
  const middle = [width / 2, isWhole ? high / 2 : high * 0.68];
  const camera = into(axes(turn, height));
  const seen = ([x, y]) => [middle[0] + radius * x, middle[1] - radius * y];
  const all = Object.values(data)
    .flatMap(({ upper, lower }) => [...upper, ...(lower ?? [])])
    .map(luminance);
  const greatest = Math.max(...all, 1e-30);
  // The longest vertex is on the rim: there are no rings to read a round number from.
  const scaled = { ...scaleOf(all, isLog), most: greatest };
  const ring = (r) =>
    path(
      Array.from({ length: 73 }, (_, i) =>
        seen(camera([r * Math.cos((i * Math.PI) / 36), r * Math.sin((i * Math.PI) / 36), 0])),
      ),
    );
  const lineTo = (from, to, name) => svg("path", { class: name, d: path([seen(camera(from)), seen(camera(to))]) });
  const surface = svg(
    "g",
    { class: "disc" },
    svg("path", { d: `${ring(1)}Z`, class: "surface" }),
    svg("path", { d: ring(0.5), class: "ring" }),
    lineTo([-1, 0, 0], [1, 0, 0], "ring"),
    lineTo([0, -1, 0], [0, 1, 0], "ring"),
  );
  const halves = (isLower) =>
    Object.entries(data)
      .filter(([, own]) => !isLower || own.lower?.length)
      .map(([side, own]) =>
        svg(
          "g",
          { class: `mesh ${side}` },
          half(own, isLower ? own.lower : own.upper, isLower, scaled, camera).map(({ points, color }) =>
            svg("path", {
              d: `${path(points.map(seen))}Z`,
              fill: side === "a" ? color : "none",
              stroke: side === "a" ? color : undefined,
            }),
          ),
        ),
      );
  const light = lineTo(inPlane(-incidence), [0, 0, 0], "light");
  const normal = lineTo([0, 0, 0], [0, 0, 1], "normal");
  const [x, y] = seen(camera([0, 0, 1]));
  const parts = [halves(true), surface, [normal, light], halves(false)];
  const label = `The lobe in space for light from ${incidence} degrees; largest value ${tickText(Number(greatest.toPrecision(3)))} per steradian`;
  return figure(
    width,
    high,
    label,
    height >= 0 ? parts : parts.reverse(),
    text(x + 5, y + 4, "n", { class: "ticks" }),
    text(8, high - 8, `longest: ${tickText(Number(greatest.toPrecision(3)))} 1/sr${isLog ? ", logarithmic" : ""}`, {
      class: "axis",
    }),
  );
}

function table(data) {
  const sides = Object.keys(data);
  const { directions } = data.a;
  const isWhole = goesThrough(data);
  const degrees = (x) => Number(((x * 180) / Math.PI).toFixed(3));
  const rows = [
    ...directions.map((d, i) => [d, i, "upper"]),
    ...(isWhole ? directions.map((d, i) => [mirrored(d), i, "lower"]) : []),
  ];
  return {
    columns: [
      "theta_deg",
      "phi_deg",
      ...sides.flatMap((side) =>
        ["r", "g", "b"].map((c) => (sides.length > 1 ? `${side.toUpperCase()}_f_${c}` : `f_${c}`)),
      ),
    ],
    rows: rows.map(([[dx, dy, dz], i, part]) => [
      degrees(Math.acos(dz)),
      degrees(Math.atan2(dy, dx)),
      ...sides.flatMap((side) => data[side][part]?.[i] ?? [0, 0, 0]),
    ]),
    isShown: ([theta, phi]) => theta % 30 === 0 && phi % 60 === 0,
  };
}

export const solid = {
  title: "3D",
  needs: "/v1/bsdf",
  hasIncidence: true,
  hasLog: true,
  turns: true,
  first,
  finer,
  draw,
  table,
};
