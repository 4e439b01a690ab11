// The polar slice: the BSDF's value over the outgoing angle, in the plane of incidence.

import { angleOf, inPlane, refined, sweep } from "./directions.js";
import { decades, figure, line, path, svg, text, ticks, tickText } from "./plot.js";
import { colorTable, curves, luminance, scaleOf, share } from "./values.js";
import { percent } from "../format-text.js";

const JUMP = 0.02; // of the radius, between two neighbours of a curve
const MOST_NEW = 60; // jumps that one refinement fills
const ROUNDS = 3;
const TABLE_STEP = 10; // degrees between the rows on the page

// f for light from -incidence; the mirror images of that direction are asked for at the end, as `delta` is of wo.
async function ofAngles(ask, material, incidence, angles) {
  const from = inPlane(-incidence);
  const { f, delta } = await ask("", { material, wo: [...angles.map(inPlane), from], wi: [from] });
  return { f: f.slice(0, -1).map(([color]) => color), delta: delta.at(-1) };
}

async function first(ask, material, { incidence }) {
  const angles = sweep(incidence);
  const { f, delta } = await ofAngles(ask, material, incidence, angles);
  return { incidence, angles, f, deltas: delta.map(({ wi, weight }) => ({ angle: angleOf(wi), weight })) };
}

// The same curve with directions between those where it jumps, or null where it is fine enough.
async function finer(ask, material, data, { isLog }, round) {
  if (round >= ROUNDS) return null;
  const values = data.f.map(luminance);
  const scale = scaleOf(values, isLog);
  const between = refined(data.angles, values.map((value) => share(value, scale)), JUMP, MOST_NEW);
  if (!between.length) return null;
  const { f } = await ofAngles(ask, material, data.incidence, between);
  const all = [...data.angles.map((angle, i) => [angle, data.f[i]]), ...between.map((angle, i) => [angle, f[i]])].sort((a, b) => a[0] - b[0]);
  return { ...data, angles: all.map(([angle]) => angle), f: all.map(([, color]) => color) };
}

export const isBelow = ({ angles, f, deltas }) =>
  angles.some((angle, i) => Math.abs(angle) > 90 && Math.max(...f[i]) > 0) || deltas.some(({ angle }) => Math.abs(angle) > 90);

// Where the plot's origin and rim are; a material that transmits has the whole circle.
export function layout({ width, height }, isWhole) {
  if (isWhole) return { x: width / 2, y: height / 2, radius: Math.max(20, Math.min(width / 2 - 30, height / 2 - 20)) };
  const radius = Math.max(20, Math.min(width / 2 - 30, height - 56));
  return { x: width / 2, y: height - (height - radius - 16) / 2 - 16, radius };
}

const arrow = (x1, y1, x2, y2, name) => {
  const turn = (Math.atan2(y2 - y1, x2 - x1) * 180) / Math.PI;
  return svg("g", { class: name }, line(x1, y1, x2, y2), svg("path", { d: "M0 0L-9 -4L-9 4Z", transform: `translate(${x2.toFixed(2)} ${y2.toFixed(2)}) rotate(${turn.toFixed(2)})` }));
};

function draw(data, { incidence, isLog, channels, size }) {
  const all = Object.values(data);
  const isWhole = all.some(isBelow) || incidence > 90;
  const { x, y, radius } = layout(size, isWhole);
  const at = (angle, length) => [x + length * Math.sin((angle * Math.PI) / 180), y - length * Math.cos((angle * Math.PI) / 180)];
  const lines = curves(data, channels, ({ f }) => f);
  const greatest = Math.max(0, ...lines.flatMap(({ values }) => values));
  const scale = scaleOf(lines.flatMap(({ values }) => values), isLog);
  const { most } = scale;
  const rings = isLog ? decades(most * 10 ** (1 - scale.decades), most, 5) : ticks(0, most, 3).slice(1);
  const spokes = Array.from({ length: isWhole ? 12 : 7 }, (_, i) => 30 * i - (isWhole ? 150 : 90));
  const half = (r) => (isWhole
    ? svg("circle", { cx: x, cy: y, r }) : svg("path", { d: `M${x - r} ${y}A${r} ${r} 0 0 1 ${x + r} ${y}` }));

  const grid = svg("g", { class: "grid" }, rings.map((value) => half(share(value, scale) * radius)),
    spokes.map((angle) => line(x, y, ...at(angle, radius))));
  const words = svg("g", { class: "ticks" },
    spokes.map((angle) => {
      const [to, down] = at(angle, radius + 11);
      return text(to, down + 4, `${Math.abs(angle)}°`, { "text-anchor": Math.abs(to - x) < 4 ? "middle" : to > x ? "start" : "end" });
    }),
    rings.map((value) => text(x + share(value, scale) * radius, y + 13, tickText(value), { "text-anchor": value === most ? "end" : "middle" })),
    text(x - radius, y + (isWhole ? -5 : 14), "f, 1/sr", { class: "axis" }));
  const surface = line(x - radius, y, x + radius, y, { class: "surface" });
  const mirror = incidence <= 90 ? line(x, y, ...at(incidence, radius), { class: "mirror" }) : null;
  const lobes = lines.map((each) => svg("path", {
    class: `curve ${each.class}`,
    d: `${path([[x, y], ...data[each.side].angles.map((angle, i) => at(angle, share(each.values[i], scale) * radius))])}Z`,
  }));
  const deltas = Object.entries(data).flatMap(([side, { deltas: own }]) => own.flatMap(({ angle, weight }) => {
    const [to, down] = at(angle, radius * 0.94);
    return [arrow(x, y, to, down, `delta ${side}`), text(to + (to > x ? -8 : 8), down + (angle > 90 ? -4 : 14), percent(luminance(weight)), { class: `delta ${side}`, "text-anchor": to > x ? "end" : "start" })];
  }));
  const light = arrow(...at(-incidence, radius), ...at(-incidence, 12), "light");
  const label = `Polar plot of the BSDF for light from ${incidence} degrees; largest value ${tickText(Number(greatest.toPrecision(3)))} per steradian`;
  return figure(size.width, size.height, label, grid, words, surface, mirror, lobes, deltas, light);
}

// The outgoing angle at a place of the plot, in whole degrees.
export function angleAt(data, { size, incidence }, px, py) {
  const { x, y } = layout(size, Object.values(data).some(isBelow) || incidence > 90);
  return Math.round((Math.atan2(px - x, y - py) * 180) / Math.PI);
}

// The values that way, in words: "62°: 0.31 1/sr"; nothing where the plot has no direction.
export function readingAt(data, options, px, py) {
  const angle = angleAt(data, options, px, py);
  if (angle < -178 || Math.abs(angle) === 90 || (Math.abs(angle) > 90 && !Object.values(data).some(isBelow))) return "";
  const sides = Object.entries(data).map(([side, { angles, f }]) => {
    const value = luminance(between(angles, f, angle));
    return `${Object.keys(data).length > 1 ? `${side.toUpperCase()} ` : ""}${tickText(Number(value.toPrecision(3)))}`;
  });
  return `${angle}°: ${sides.join(", ")} 1/sr`;
}

function table(data) {
  const { angles } = data.a;
  const whole = colorTable(data, "theta_deg", angles, ({ angles: own, f }) => angles.map((angle) => f[own.indexOf(angle)] ?? between(own, f, angle)), "f");
  const isWhole = Object.values(data).some(isBelow);
  return { ...whole, rows: whole.rows.filter(([angle]) => isWhole || Math.abs(angle) < 90), isShown: ([angle]) => angle % TABLE_STEP === 0 };
}

// The variants are refined at places of their own: a value between two of them.
function between(angles, f, angle) {
  const to = Math.min(Math.max(angles.findIndex((each) => each > angle), 1), angles.length - 1);
  const t = (angle - angles[to - 1]) / (angles[to] - angles[to - 1]);
  return f[to].map((value, i) => f[to - 1][i] + t * (value - f[to - 1][i]));
}

export const polar = { title: "Polar", needs: "/v1/bsdf", hasIncidence: true, hasLog: true, hasChannels: true, first, finer, draw, table };
