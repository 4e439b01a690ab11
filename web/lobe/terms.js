// The terms of a model of microfacets over the angle: the distribution D of the normals, the geometry term G, the
// Fresnel reflectance F. The server refuses a model that has none.

import { chart, decades, niceCeiling, svg } from "./plot.js";
import { CHANNELS, channelClass, column, RGB } from "./values.js";

const fine = Array.from({ length: 40 }, (_, i) => 0.02 * 1.13 ** i).filter((angle) => angle < 3); // where D of a polished surface falls
const ANGLES = [0, ...fine, ...Array.from({ length: 87 }, (_, i) => i + 3), 89.5];
const cosines = ANGLES.map((angle) => Math.cos((angle * Math.PI) / 180));
const LEAST = 1e-6; // of the greatest D: what a logarithmic scale shows

async function first(ask, material, { incidence }) {
  const wo_cosine = Math.cos((Math.min(incidence, 89.5) * Math.PI) / 180);
  return { incidence, ...(await ask("/terms", { material, cosines, wo_cosine })) };
}

const PARTS = [
  { name: "distribution", letter: "D", title: "D, 1/sr", over: "angle of the facet's normal" },
  { name: "geometry", letter: "G", title: "G", over: "angle of the other direction" },
  { name: "fresnel", letter: "F", title: "F", over: "angle at the facet" },
];

function part({ name, letter, title, over }, data, { isLog, channels, size }) {
  const sides = Object.entries(data).filter(([, own]) => own[name]);
  if (!sides.length) return null;
  const lines = sides.flatMap(([side, own]) =>
    name === "fresnel"
      ? CHANNELS[channels].map((channel) => ({
          class: `${side} ${channelClass(channel.name)}`,
          values: own.fresnel.map(channel.of),
        }))
      : [{ class: `${side} y`, values: own[name] }],
  );
  const greatest = Math.max(...lines.flatMap(({ values }) => values));
  const isLogHere = isLog && name === "distribution";
  const top =
    name !== "distribution" ? 1 : isLogHere ? 10 ** Math.ceil(Math.log10(greatest) - 1e-9) : niceCeiling(greatest);
  const least = isLogHere
    ? Math.max(
        LEAST * top,
        10 ** Math.floor(Math.log10(Math.min(...lines.flatMap(({ values }) => values.filter((x) => x > 0))))),
      )
    : 0;
  return chart({
    ...size,
    label: `${letter} over the ${over}; largest value ${Number(greatest.toPrecision(3))}`,
    x: { min: 0, max: 90, ticks: [0, 30, 60, 90], label: `${over}, degrees` },
    y: {
      min: Math.min(least, top / 10),
      max: top,
      log: isLogHere,
      ticks: isLogHere ? decades(least, top, 4) : undefined,
      label: title,
    },
    curves: lines.map(({ values, class: own }) => ({
      class: own,
      points: values.map((value, i) => [ANGLES[i], value]),
    })),
  });
}

function draw(data, options) {
  const { width, height } = options.size;
  const has = PARTS.filter(({ name }) => Object.values(data).some((own) => own[name]));
  const isRow = width > 1.6 * height; // where there is more width than height, side by side
  const size = isRow ? { width: width / has.length, height } : { width, height: height / has.length };
  const whole = isRow ? { width, height } : { width, height: size.height * has.length };
  const parts = has.map((each, i) => {
    const node = part(each, data, { ...options, size });
    for (const [name, value] of [
      ["x", isRow ? i * size.width : 0],
      ["y", isRow ? 0 : i * size.height],
    ])
      node.setAttribute(name, String(value));
    return node;
  });
  return svg(
    "svg",
    {
      ...whole,
      viewBox: `0 0 ${whole.width} ${whole.height}`,
      class: "plot",
      role: "group",
      "aria-label": "D, G and F",
    },
    parts,
  );
}

function note(data) {
  const mirrors = Object.values(data).filter((own) => !own.distribution).length;
  return mirrors
    ? "A perfect mirror has no distribution and no geometry term."
    : `G is for light from ${Object.values(data)[0].incidence}°.`;
}

function table(data) {
  const sides = Object.keys(data);
  return {
    columns: [
      "theta_deg",
      ...sides.flatMap((side) => [
        ...(data[side].distribution ? [column(data, side, "D"), column(data, side, "G")] : []),
        ...RGB.map((c) => column(data, side, `F_${c}`)),
      ]),
    ],
    rows: ANGLES.map((angle, i) => [
      angle,
      ...sides.flatMap((side) => [
        ...(data[side].distribution ? [data[side].distribution[i], data[side].geometry[i]] : []),
        ...data[side].fresnel[i],
      ]),
    ]),
    isShown: ([angle]) => angle % 5 === 0,
  };
}

export const terms = {
  title: "D G F",
  needs: "/v1/bsdf/terms",
  hasIncidence: true,
  hasLog: true,
  hasChannels: true,
  first,
  draw,
  note,
  table,
};
