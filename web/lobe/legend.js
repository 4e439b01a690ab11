// What the colours of a plot mean.

import { lit } from "./polar.js";
import { slice } from "./slice.js";
import { channelClass } from "./values.js";
import { element } from "../lib/dom.js";
import { inWords } from "../lib/format-text.js";

const RGB = [
  ["r", "red"],
  ["g", "green"],
  ["b", "blue"],
];

const key = (swatch, ...words) =>
  element("span", { class: "key" }, element("i", { class: `swatch ${swatch}` }), ...words);

// The keys of `data`, {a, b?}, in `view`; `models` are the types of the two variants' materials.
export function legend(view, data, channels, models) {
  const plotted = view.hasChannels && channels === "rgb" ? RGB : [["y", ""]];
  const sides = Object.keys(data);
  const nameOf = (side) => `${sides.length > 1 ? `${side.toUpperCase()}, ` : ""}${inWords(models[side] ?? "")}`;
  const keyOf = (side, [channel, title]) =>
    key(`${side} ${channelClass(channel)}`, [nameOf(side), title].filter(Boolean).join(", "));
  const curves = view === slice ? [] : sides.flatMap((side) => plotted.map((channel) => keyOf(side, channel)));
  const lobes = new Set(view.hasLobes ? Object.values(data).flatMap((own) => lit(own).map(({ name }) => name)) : []);
  const hasDeltas = Object.values(data).some((own) => own.deltas?.length);
  return [
    ...curves,
    ...[...lobes].map((name) => key(`lobe-${name}`, name)),
    ...(hasDeltas ? [key("delta", "perfectly specular, share of the light")] : []),
  ];
}
