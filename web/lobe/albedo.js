// The directional albedo over the angle of the view, and its mean under uniform light, the number of a white furnace.

import { chart, line, niceCeiling, text } from "./plot.js";
import { CHANNELS, column, curves, isGrey, luminance, RGB } from "./values.js";

const ANGLES = [...Array.from({ length: 18 }, (_, i) => 5 * i), 87, 88.5, 89.5];
const cosines = ANGLES.map((angle) => Math.cos((angle * Math.PI) / 180));
const SAMPLES = [256, 4096, 32768]; // a first curve at once, then finer ones
const SURE = 2; // standard errors on each side of the curve: 95 %

async function first(ask, material) {
  return { samples: SAMPLES[0], ...(await ask("/albedo", { material, cosines, samples: SAMPLES[0] })) };
}

async function finer(ask, material, data, options, round) {
  const samples = SAMPLES[round + 1];
  return samples ? { samples, ...(await ask("/albedo", { material, cosines, samples })) } : null;
}

// The share of uniform light that comes back, 2 * integral of albedo(mu) mu dmu: {value, error}, of values at ANGLES.
// Exact for an albedo that is linear in mu^2 between them; beyond the last angle it stays, over 1e-4 of the integral.
export function furnace(values, errors) {
  const squares = [...cosines.map((mu) => mu * mu), 0];
  const weights = values.map((_, i) => {
    const last = i === values.length - 1;
    return ((i ? squares[i - 1] - squares[i] : 0) + (last ? 2 * squares[i] : squares[i] - squares[i + 1])) / 2;
  });
  return {
    value: values.reduce((sum, x, i) => sum + weights[i] * x, 0),
    error: Math.hypot(...errors.map((x, i) => weights[i] * x)),
  };
}

const numbers = (data) =>
  Object.entries(data).map(([side, { albedo, error }]) => {
    const { value, error: own } = furnace(
      albedo.map(luminance),
      error.map((each) => luminance(each.map((x) => x ?? 0))),
    );
    return { side, value, error: own, most: Math.max(...albedo.flat()) };
  });

const said = ({ value, error }) => `${value.toFixed(3)} ± ${Math.max(SURE * error, 0.001).toFixed(3)}`;

function draw(data, { channels, size }) {
  const lines = curves(data, channels, ({ albedo }) => albedo);
  const greatest = Math.max(1, ...lines.flatMap(({ values }) => values));
  return chart({
    ...size,
    label: `Directional albedo over the angle; white furnace ${numbers(data).map(said).join(" and ")}`,
    x: { min: 0, max: 90, ticks: [0, 15, 30, 45, 60, 75, 90], label: "angle of the view, degrees" },
    y: {
      min: 0,
      max: greatest > 2 ? niceCeiling(greatest) : greatest > 1.05 ? Math.ceil(10 * greatest + 0.3) / 10 : 1.05,
      label: "albedo",
    },
    curves: lines.map(({ values, class: name }) => ({
      class: name,
      points: values.map((value, i) => [ANGLES[i], value]),
    })),
    bands: lines.map(({ side, channel, values, class: name }) => ({
      class: name,
      points: values.map((value, i) => {
        const error =
          SURE * CHANNELS[channels].find((each) => each.name === channel).of(data[side].error[i].map((x) => x ?? 0));
        return [ANGLES[i], value - error, value + error];
      }),
    })),
    marks: (toX, toY, box) => [
      line(box.left, toY(1), box.right, toY(1), { class: "limit" }),
      text(box.left + 6, toY(1) + 13, "all of the light", { class: "dim" }),
    ],
  });
}

// What is said under the plot.
function note(data) {
  return numbers(data)
    .map(({ side, most, ...own }) => {
      const whose = Object.keys(data).length > 1 ? `${side.toUpperCase()}: ` : "";
      const gain = most > 1.003 ? ` It sends back more light than it gets, up to ${most.toFixed(3)}.` : "";
      const grey = isGrey(data[side].albedo) ? "" : " in luminance";
      return `${whose}White furnace ${said(own)}${grey}.${gain}`;
    })
    .join(" ")
    .concat(" That is the share of uniform light that comes back.");
}

function table(data) {
  const sides = Object.keys(data);
  return {
    columns: [
      "theta_deg",
      ...sides.flatMap((side) => [
        ...RGB.map((c) => column(data, side, `albedo_${c}`)),
        ...RGB.map((c) => column(data, side, `error_${c}`)),
      ]),
    ],
    rows: ANGLES.map((angle, i) => [
      angle,
      ...sides.flatMap((side) => [...data[side].albedo[i], ...data[side].error[i]]),
    ]),
  };
}

export const albedo = {
  title: "Albedo",
  needs: "/v1/bsdf/albedo",
  hasChannels: true,
  first,
  finer,
  draw,
  note,
  table,
};
