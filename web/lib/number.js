// Numbers as people write them: decimals with a comma, shares in per cent, small sums. Nothing is guessed: what
// is no number is null.

const TOKEN = /\s*(?:((?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)(\s*%)?|([-+*/()]))/giy;

function tokens(text) {
  const found = [];
  TOKEN.lastIndex = 0;
  while (TOKEN.lastIndex < text.length) {
    const match = TOKEN.exec(text);
    if (!match) return null;
    const [, digits, share, sign] = match;
    found.push(sign ?? Number(digits) / (share ? 100 : 1));
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

// The number that a text says, or null: "0,35", "1/3", "50 %", "2 * (1 + .5)", "16 777 216", "30°" with the
// unit "°". A comma beside a point could mean thousands or decimals, so that is no number.
export function parseNumber(text, unit = "") {
  let plain = text.trim().replaceAll("\u2212", "-");
  if (unit && plain.endsWith(unit)) plain = plain.slice(0, -unit.length);
  if (plain.includes(",") && plain.includes(".")) return null;
  plain = plain.replaceAll(",", ".").replaceAll(/(?<=\d)[\s\u202f](?=\d{3}(?!\d))/g, "");
  if (unit && plain.includes("%")) return null; // of what?
  const found = tokens(plain);
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
