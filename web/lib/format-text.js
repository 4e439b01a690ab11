// Numbers, units and names as an artist reads them.

const UNITS = { degrees: "°", um: "µm", "W/(m^2 sr)": "W/(m² sr)", "W/m^2": "W/m²", "cd/m^2": "cd/m²" };
const NAMES = {
  aces: "ACES",
  aces2: "ACES 2",
  agx: "AgX",
  pbr_neutral: "PBR neutral",
  mis: "MIS",
  bsdf: "BSDF",
  blackman_harris: "Blackman\u2013Harris",
  ggx: "GGX",
  gtr: "GTR",
  abc: "ABC",
  sgd: "SGD",
  eon: "EON",
  oren_nayar: "Oren\u2013Nayar",
  cook_torrance: "Cook\u2013Torrance",
  schlick_ggx: "Schlick\u2013GGX",
  color: "Colour",
  uv: "UV",
  shape_id: "Shapes",
  material_id: "Materials",
};

// Takes over how names of the server's are written: {name: words}.
export const learnNames = (names) => Object.assign(NAMES, names);

export const unitText = (unit) => UNITS[unit] ?? unit;

// "two_boxes" -> "Two boxes".
export function inWords(name) {
  const spaced = name.replaceAll(/[_-]/g, " ");
  return NAMES[name] ?? spaced.charAt(0).toUpperCase() + spaced.slice(1);
}

// Four digits that count, without trailing zeros; of a number for each channel, all three.
export const compact = (value) =>
  [value]
    .flat()
    .map((each) => String(Number(each.toPrecision(4))))
    .join(", ");

const NARROW = 7; // letters that a field of three beside each other shows

// A number of several whose greatest is `most`, as short as such a field needs it; what is left of a rounding is 0.
export function narrow(value, most) {
  if (Math.abs(value) < 1e-6 * most) return "0";
  const texts = [
    ...[4, 3].map((digits) => String(Number(value.toPrecision(digits)))),
    ...[2, 1].map((digits) => value.toExponential(digits)),
  ];
  return texts.find((text) => text.length <= NARROW) ?? texts.at(-1);
}

export function duration(seconds) {
  if (seconds < 9.95) return `${seconds.toFixed(1)} s`;
  if (seconds < 99.5) return `${Math.round(seconds)} s`;
  const minutes = Math.round(seconds / 60);
  return minutes < 100 ? `${minutes} min` : `${Math.round(minutes / 60)} h`;
}

export const percent = (ratio) => `${Number((100 * ratio).toPrecision(2))}\u00a0%`;

// What the server says of a thing, as a sentence of its own.
export const sentence = (text) => text.charAt(0).toUpperCase() + text.slice(1);

// "1 sample", "4 samples".
export const amount = (n, thing) => `${count(n)} ${thing}${n === 1 ? "" : "s"}`;

// 16777216 -> "16 777 216", with spaces that do not break.
export const count = (n) => n.toLocaleString("en").replaceAll(",", "\u202f");
