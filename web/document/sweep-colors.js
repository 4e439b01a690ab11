// Colours from one to another, as an eye sees them to be evenly apart: the shorter way round the hues [Ottosson 2020].

const TURN = Math.PI / 3; // of the hue, before and after a colour, where nobody says from which to which
const GREY = 0.02; // of chroma, below which a colour has no hue
const GREYS = [0.15, 0.95]; // lightness

const ROOTS = [
  [0.4122214708, 0.5363325363, 0.0514459929],
  [0.2119034982, 0.6806995451, 0.1073969566],
  [0.0883024619, 0.2817188376, 0.6299787005],
];
const LAB = [
  [0.2104542553, 0.793617785, -0.0040720468],
  [1.9779984951, -2.428592205, 0.4505937099],
  [0.0259040371, 0.7827717662, -0.808675766],
];
const CUBES = [
  [1, 0.3963377774, 0.2158037573],
  [1, -0.1055613458, -0.0638541728],
  [1, -0.0894841775, -1.291485548],
];
const RGB = [
  [4.0767416621, -3.3077115913, 0.2309699292],
  [-1.2684380046, 2.6097574011, -0.3413193965],
  [-0.0041960863, -0.7034186147, 1.707614701],
];

const apply = (matrix, v) => matrix.map((row) => row.reduce((sum, x, i) => sum + x * v[i], 0));

// {light, chroma, hue} of a linear colour, and back; what does not fit is cut off.
function polar(rgb) {
  const [light, a, b] = apply(
    LAB,
    apply(ROOTS, rgb).map((x) => Math.cbrt(x)),
  );
  return { light, chroma: Math.hypot(a, b), hue: Math.atan2(b, a) };
}

function linearOf({ light, chroma, hue }) {
  const roots = apply(CUBES, [light, chroma * Math.cos(hue), chroma * Math.sin(hue)]);
  return apply(
    RGB,
    roots.map((x) => x ** 3),
  ).map((x) => Math.min(Math.max(x, 0), 1));
}

// The two ends of a sweep round a linear colour: hues on both sides of its own, or of a grey darker and lighter ones.
export function endsRound(rgb) {
  const own = polar(rgb);
  if (own.chroma < GREY) return GREYS.map((light) => linearOf({ ...own, light, chroma: 0 }));
  return [-TURN, TURN].map((turn) => linearOf({ ...own, hue: own.hue + turn }));
}

// So many linear colours from one to another.
export function colorsBetween(from, to, count) {
  const [a, b] = [from, to].map(polar);
  if (a.chroma < GREY) a.hue = b.hue;
  if (b.chroma < GREY) b.hue = a.hue;
  const turn = Math.atan2(Math.sin(b.hue - a.hue), Math.cos(b.hue - a.hue));
  return Array.from({ length: count }, (_, i) => {
    const share = i / (count - 1);
    const mix = (x, y) => x + (y - x) * share;
    return linearOf({ light: mix(a.light, b.light), chroma: mix(a.chroma, b.chroma), hue: a.hue + turn * share });
  });
}
