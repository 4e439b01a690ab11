// The polar slice: the BSDF's value over the outgoing angle, in the plane of incidence.

import { angleOf, inPlane, refined, sweep } from "./directions.js";
import { decades, figure, line, path, svg, text, ticks, tickText } from "./plot.js";
import { colorTable, column, curves, luminance, scaleOf, share } from "./values.js";
import { percent } from "../lib/format-text.js";

const JUMP = 0.02; // of the radius, between two neighbours of a curve
const MOST_NEW = 60; // jumps that one refinement fills
const ROUNDS = 3;
const TABLE_STEP = 10; // degrees between the rows on the page
const TICK_GAP = 40; // CSS pixels from the rim's number to the next one

// f for light from -incidence, and where `byLobe` its parts [{name, f}]; the mirror images of that direction are asked
// for at the end, as `delta` is of wo.
async function ofAngles(ask, material, incidence, angles, byLobe) {
  const from = inPlane(-incidence);
  const {
    f,
    delta,
    lobes = [],
  } = await ask("", { material, wo: [...angles.map(inPlane), from], wi: [from], ...(byLobe ? { lobes: true } : {}) });
  const along = (values) => values.slice(0, -1).map(([color]) => color);
  return { f: along(f), lobes: lobes.map(({ name, f: own }) => ({ name, f: along(own) })), delta: delta.at(-1) };
}

async function first(ask, material, { incidence, byLobe }) {
  const angles = sweep(incidence);
  const { f, lobes, delta } = await ofAngles(ask, material, incidence, angles, byLobe);
  return { incidence, angles, f, lobes, deltas: delta.map(({ wi, weight }) => ({ angle: angleOf(wi), weight })) };
}

// The same curve with directions between those where it jumps, or null where it is fine enough.
async function finer(ask, material, data, { isLog }, round) {
  if (round >= ROUNDS) return null;
  const values = data.f.map(luminance);
  const scale = scaleOf(values, isLog);
  const between = refined(
    data.angles,
    values.map((value) => share(value, scale)),
    JUMP,
    MOST_NEW,
  );
  if (!between.length) return null;
  const { f, lobes } = await ofAngles(ask, material, data.incidence, between, data.lobes.length > 0);
  const angles = [...data.angles, ...between];
  const order = angles.map((_, i) => i).sort((i, j) => angles[i] - angles[j]);
  const merged = (old, more) => order.map((i) => [...old, ...more][i]);
  return {
    ...data,
    angles: order.map((i) => angles[i]),
    f: merged(data.f, f),
    lobes: data.lobes.map(({ name, f: old }, k) => ({ name, f: merged(old, lobes[k].f) })),
  };
}

// The lobes that the material has: the others are 0 at every angle.
export const lit = ({ lobes }) => lobes.filter(({ f }) => f.some((color) => Math.max(...color) > 0));

export const isBelow = ({ angles, f, deltas }) =>
  angles.some((angle, i) => Math.abs(angle) > 90 && Math.max(...f[i]) > 0) ||
  deltas.some(({ angle }) => Math.abs(angle) > 90);

// Where the plot's origin and rim are; a material that transmits has the whole circle.
export function layout({ width, height }, isWhole) {
  if (isWhole)
    return { x: width / 2, y: height / 2, radius: Math.max(20, Math.min(width / 2 - 30, height / 2 - 20)) };
  const radius = Math.max(20, Math.min(width / 2 - 30, height - 56));
  return { x: width / 2, y: height - (height - radius - 16) / 2 - 16, radius };
}

const arrow = (x1, y1, x2, y2, name) => {
  const turn = (Math.atan2(y2 - y1, x2 - x1) * 180) / Math.PI;
  return svg(
    "g",
    { class: name },
    line(x1, y1, x2, y2),
    svg("path", {
      d: "M0 0L-9 -4L-9 4Z",
      transform: `translate(${x2.toFixed(2)} ${y2.toFixed(2)}) rotate(${turn.toFixed(2)})`,
    }),
  );
};

function draw(data, { incidence, isLog, channels, size }) {
  const all = Object.values(data);
  const isWhole = all.some(isBelow) || incidence > 90;
  const { x, y, radius } = layout(size, isWhole);
  const at = (angle, length) => [
    x + length * Math.sin((angle * Math.PI) / 180),
    y - length * Math.cos((angle * Math.PI) / 180),
  ];
  const lines = curves(data, channels, ({ f }) => f);
  const greatest = Math.max(0, ...lines.flatMap(({ values }) => values));
  const scale = scaleOf(
    lines.flatMap(({ values }) => values),
    isLog,
  );
  const { most } = scale;
  const rings = isLog ? decades(most * 10 ** (1 - scale.decades), most, 5) : ticks(0, most, 3).slice(1);
  const spokes = Array.from({ length: isWhole ? 12 : 7 }, (_, i) => 30 * i - (isWhole ? 150 : 90));
  const half = (r) =>
    isWhole ? svg("circle", { cx: x, cy: y, r }) : svg("path", { d: `M${x - r} ${y}A${r} ${r} 0 0 1 ${x + r} ${y}` });

  const grid = svg(
    "g",
    { class: "grid" },
    rings.map((value) => half(share(value, scale) * radius)),
    spokes.map((angle) => line(x, y, ...at(angle, radius))),
  );
  const words = svg(
    "g",
    { class: "ticks" },
    spokes.map((angle) => {
      const [to, down] = at(angle, radius + 11);
      return text(to, down + 4, `${Math.abs(angle)}°`, {
        "text-anchor": Math.abs(to - x) < 4 ? "middle" : to > x ? "start" : "end",
      });
    }),
    rings
      .filter((value) => value === most || (1 - share(value, scale)) * radius > TICK_GAP)
      .map((value) =>
        text(x + share(value, scale) * radius, y + 13, tickText(value), {
          "text-anchor": value === most ? "end" : "middle",
        }),
      ),
    text(x - radius, y + (isWhole ? -5 : 14), "f, 1/sr", { class: "axis" }),
  );
  const surface = line(x - radius, y, x + radius, y, { class: "surface" });
  const mirror = incidence <= 90 ? line(x, y, ...at(incidence, radius), { class: "mirror" }) : null;
  const parts = Object.entries(data).flatMap(([side, own]) =>
    lit(own).map(({ name, f }) => ({ side, class: `${side} lobe-${name}`, values: f.map(luminance) })),
  );
  const drawn = [...parts, ...lines].map((each) =>
    svg("path", {
      class: `curve ${each.class}`,
      d: `${path([[x, y], ...data[each.side].angles.map((angle, i) => at(angle, share(each.values[i], scale) * radius))])}Z`,
    }),
  );
  const deltas = Object.entries(data).flatMap(([side, { deltas: own }]) =>
    own.flatMap(({ angle, weight }) => {
      const [to, down] = at(angle, radius * 0.94);
      return [
        arrow(x, y, to, down, `delta ${side}`),
        text(to + (to > x ? -8 : 8), down + (angle > 90 ? -4 : 14), percent(luminance(weight)), {
          class: `delta ${side}`,
          "text-anchor": to > x ? "end" : "start",
        }),
      ];
    }),
  );
  const light = arrow(...at(-incidence, radius), ...at(-incidence, 12), "light");
  const label = `Polar plot of the BSDF for light from ${incidence} degrees; largest value ${tickText(Number(greatest.toPrecision(3)))} per steradian`;
  return figure(size.width, size.height, label, grid, words, surface, mirror, drawn, deltas, light);
}

// The outgoing angle at a place of the plot, in whole degrees.
export function angleAt(data, { size, incidence }, px, py) {
  const { x, y } = layout(size, Object.values(data).some(isBelow) || incidence > 90);
  return Math.round((Math.atan2(px - x, y - py) * 180) / Math.PI);
}

// The values that way, in words: "62°: 0.31 1/sr"; nothing where the plot has no direction.
export function readingAt(data, options, px, py) {
  const angle = angleAt(data, options, px, py);
  if (angle < -178 || Math.abs(angle) === 90 || (Math.abs(angle) > 90 && !Object.values(data).some(isBelow)))
    return "";
  const sides = Object.entries(data).map(([side, { angles, f }]) => {
    const value = luminance(between(angles, f, angle));
    return `${Object.keys(data).length > 1 ? `${side.toUpperCase()} ` : ""}${tickText(Number(value.toPrecision(3)))}`;
  });
  return `${angle}°: ${sides.join(", ")} 1/sr`;
}

function table(data) {
  const { angles } = data.a;
  const at = (own, f) => angles.map((angle) => f[own.indexOf(angle)] ?? between(own, f, angle));
  const whole = colorTable(data, "theta_deg", angles, ({ angles: own, f }) => at(own, f), "f");
  for (const [side, own] of Object.entries(data)) {
    for (const { name, f } of lit(own)) {
      whole.columns.push(...["r", "g", "b"].map((channel) => column(data, side, `f_${name}_${channel}`)));
      at(own.angles, f).forEach((color, i) => whole.rows[i].push(...color));
    }
  }
  const isWhole = Object.values(data).some(isBelow);
  return {
    ...whole,
    rows: whole.rows.filter(([angle]) => isWhole || Math.abs(angle) < 90),
    isShown: ([angle]) => angle % TABLE_STEP === 0,
  };
}

// The variants are refined at places of their own: a value between two of them.
function between(angles, f, angle) {
  const to = Math.min(
    Math.max(
      angles.findIndex((each) => each > angle),
      1,
    ),
    angles.length - 1,
  );
  const t = (angle - angles[to - 1]) / (angles[to] - angles[to - 1]);
  return f[to].map((value, i) => f[to - 1][i] + t * (value - f[to - 1][i]));
}

export const polar = {
  title: "Polar",
  needs: "/v1/bsdf",
  hasIncidence: true,
  hasLog: true,
  hasChannels: true,
  hasLobes: true,
  first,
  finer,
  draw,
  table,
};
