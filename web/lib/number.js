// Numbers as people write them: decimals with a comma, shares in per cent, small sums. Nothing is guessed: what
// is no number is null.

const TOKEN = /\s*(?:((?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)(?:\s*([^\s\d.+*/()-]+))?|([-+*/()]))/giy;

// Other units that may stand behind a number, as factors of the field's own.
const UNITS = {
  m: { km: 1000, cm: 0.01, mm: 0.001, µm: 1e-6, nm: 1e-9, in: 0.0254, ft: 0.3048 },
  "°": { deg: 1, rad: 180 / Math.PI },
  s: { ms: 0.001, min: 60, h: 3600 },
  pixels: { px: 1 },
};

// Numbers, each in the field's unit, and signs; null where there is anything else.
function tokens(text, unit) {
  const factors = { ...UNITS[unit], ...(unit ? { [unit]: 1 } : { "%": 0.01 }) }; // a share of what, where there is a unit?
  const found = [];
  TOKEN.lastIndex = 0;
  while (TOKEN.lastIndex < text.length) {
    const match = TOKEN.exec(text);
    if (!match) return null;
    const [, digits, own, sign] = match;
    if (own && !Object.hasOwn(factors, own)) return null;
    found.push(sign ?? Number(digits) * (own ? factors[own] : 1));
  }
  return found;
}

// sum = product {(+|-) product}; product = factor {(*|/) factor}; factor = [+|-] (number | "(" sum ")").
function calculate(rest) {
  const factor = () => {
    const next = rest.shift();
    if (next === "-") return -factor();
    if (next === "+") return factor();
    if (next !== "(") return typeof next === "number" ? next : NaN;
    const inside = sum();
    return rest.shift() === ")" ? inside : NaN;
  };
  const product = () => {
    let value = factor();
    while (rest[0] === "*" || rest[0] === "/") value = rest.shift() === "*" ? value * factor() : value / factor();
    return value;
  };
  const sum = () => {
    let value = product();
    while (rest[0] === "+" || rest[0] === "-") value = rest.shift() === "+" ? value + product() : value - product();
    return value;
  };
  const value = sum();
  return rest.length ? NaN : value;
}

// The number that a text says, or null: "0,35", "1/3", "50 %", "2 * (1 + .5)", "16 777 216"; with a unit also in that one
// or its kin: "30°", "0.5 rad", "1 + 20 cm". A comma beside a point could mean thousands or decimals, so that is no number.
export function parseNumber(text, unit = "") {
  let plain = text.trim().replaceAll("\u2212", "-");
  if (unit && !UNITS[unit] && plain.endsWith(unit)) plain = plain.slice(0, -unit.length).trimEnd(); // such as W/(m² sr)
  if (plain.includes(",") && plain.includes(".")) return null;
  const found = tokens(plain.replaceAll(",", ".").replaceAll(/(?<=\d)[\s\u202f](?=\d{3}(?!\d))/g, ""), unit);
  const value = found?.length ? calculate(found) : NaN;
  return Number.isFinite(value) ? Number(value.toPrecision(12)) : null;
}

// Three numbers of a colour, parted by spaces, semicolons or commas: [r, g, b] or null.
export function parseTriple(text) {
  const apart = text.trim().split(/[\s;]+/);
  const parts = apart.length === 1 ? apart[0].split(",") : apart.map((part) => part.replace(/,$/, ""));
  const numbers = parts.map((part) => parseNumber(part));
  return numbers.length === 3 && numbers.every((number) => number !== null) ? numbers : null;
}

export const NEEDED = "A number is needed here, such as 0.5, 0,5, 1/3 or 50%.";
export const neededIn = (unit) => (unit ? `A number is needed here, in ${unit}, such as 0.5, 0,5 or 1/3.` : NEEDED);
