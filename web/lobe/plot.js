// A few lines that draw curves as SVG: scales, ticks, axes. Sizes are CSS pixels, so that text keeps its size.

const NAMESPACE = "http://www.w3.org/2000/svg";

export function svg(tag, attributes = {}, ...children) {
  const node = document.createElementNS(NAMESPACE, tag);
  for (const [name, value] of Object.entries(attributes))
    if (value !== undefined) node.setAttribute(name, String(value));
  node.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return node;
}

export const text = (x, y, words, attributes = {}) => svg("text", { x, y, ...attributes }, words);
export const line = (x1, y1, x2, y2, attributes = {}) => svg("line", { x1, y1, x2, y2, ...attributes });

// An SVG of a size in pixels; `label` is what a screen reader says of it.
export const figure = (width, height, label, ...children) =>
  svg(
    "svg",
    { viewBox: `0 0 ${width} ${height}`, width, height, role: "img", "aria-label": label, class: "plot" },
    ...children,
  );

const STEPS = [1, 2, 5, 10];

// A step of 1, 2 or 5 times a power of ten that parts a range into `parts` or a few more or less.
function niceStep(range, parts) {
  const rough = range / parts;
  const power = 10 ** Math.floor(Math.log10(rough));
  return power * STEPS.find((step) => step * power >= rough * 0.8);
}

// The smallest number of 1, 2, 2.5, 5 times a power of ten that is not below.
export function niceCeiling(value) {
  if (!(value > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  return power * [1, 2, 2.5, 5, 10].find((step) => step * power >= value * 0.9999);
}

export function ticks(min, max, parts) {
  const step = niceStep(max - min, parts);
  const first = Math.ceil(min / step - 1e-9);
  const count = Math.floor(max / step + 1e-9) - first;
  return Array.from({ length: count + 1 }, (_, i) => Number(((first + i) * step).toPrecision(12)));
}

// Powers of ten from `min` to `max`, at most `most` of them.
export function decades(min, max, most = 6) {
  const [low, high] = [Math.ceil(Math.log10(min) - 1e-9), Math.floor(Math.log10(max) + 1e-9)];
  const stride = Math.max(1, Math.ceil((high - low + 1) / most));
  const found = [];
  for (let k = high; k >= low; k -= stride) found.unshift(k);
  return found.map((k) => Number(`1e${k}`));
}

const RAISED = {
  "-": "\u207b",
  0: "\u2070",
  1: "\u00b9",
  2: "\u00b2",
  3: "\u00b3",
  4: "\u2074",
  5: "\u2075",
  6: "\u2076",
  7: "\u2077",
  8: "\u2078",
  9: "\u2079",
};

// "0.05", "20", and "10⁻⁴" beyond what is read at a glance.
export function tickText(value) {
  if (value === 0) return "0";
  const exponent = Math.log10(Math.abs(value));
  if (exponent >= -2.01 && exponent < 4) return String(Number(value.toPrecision(3)));
  const power = Math.floor(exponent + 1e-9);
  const lead = Number((value / 10 ** power).toPrecision(2));
  return `${lead === 1 ? "" : `${lead}\u00b7`}10${[...String(power)].map((c) => RAISED[c]).join("")}`;
}

// The path through points, in pixels with two digits; a point that is not finite parts it.
export function path(points) {
  let isPen = false;
  return points
    .map(([x, y]) => {
      const command = isPen ? "L" : "M";
      isPen = Number.isFinite(x) && Number.isFinite(y);
      return isPen ? `${command}${x.toFixed(2)} ${y.toFixed(2)}` : "";
    })
    .join("");
}

const MARGIN = { left: 46, right: 12, top: 12, bottom: 34 };

// A chart with axes: {node, x(value), y(value)}. `x` and `y` are {min, max, label, ticks?, log?}; curves are
// [{points: [[x, y]], class}] , bands [{points: [[x, low, high]], class}], and marks any nodes made with the scales.
export function chart({ width, height, label, x, y, curves, bands = [], marks = () => [] }) {
  const box = { left: MARGIN.left, top: MARGIN.top, right: width - MARGIN.right, bottom: height - MARGIN.bottom };
  const place =
    ({ min, max, log }, from, to) =>
    (value) => {
      const share = log ? Math.log(Math.max(value, min) / min) / Math.log(max / min) : (value - min) / (max - min);
      return from + share * (to - from);
    };
  const toX = place(x, box.left, box.right);
  const toY = place(y, box.bottom, box.top);
  const marksOf = ({ min, max, log, ticks: given }, parts) =>
    given ?? (log ? decades(min, max, parts + 1) : ticks(min, max, parts));
  const grid = svg(
    "g",
    { class: "grid" },
    marksOf(x, Math.max(3, Math.floor(width / 60))).map((value) => line(toX(value), box.top, toX(value), box.bottom)),
    marksOf(y, Math.max(2, Math.floor(height / 45))).map((value) =>
      line(box.left, toY(value), box.right, toY(value)),
    ),
  );
  const words = svg(
    "g",
    { class: "ticks" },
    marksOf(x, Math.max(3, Math.floor(width / 60))).map((value) =>
      text(toX(value), box.bottom + 14, tickText(value), { "text-anchor": "middle" }),
    ),
    marksOf(y, Math.max(2, Math.floor(height / 45))).map((value) =>
      text(box.left - 6, toY(value) + 4, tickText(value), { "text-anchor": "end" }),
    ),
    text((box.left + box.right) / 2, height - 5, x.label, { "text-anchor": "middle", class: "axis" }),
    svg(
      "text",
      {
        transform: `translate(11 ${(box.top + box.bottom) / 2}) rotate(-90)`,
        "text-anchor": "middle",
        class: "axis",
      },
      y.label,
    ),
  );
  const inside = `clip-${label.replaceAll(/\W/g, "")}`;
  const clip = svg(
    "clipPath",
    { id: inside },
    svg("rect", { x: box.left, y: box.top, width: box.right - box.left, height: box.bottom - box.top }),
  );
  const drawn = svg(
    "g",
    { "clip-path": `url(#${inside})` },
    bands.map(({ points, class: name }) =>
      svg("path", {
        class: `band ${name}`,
        d: `${path([...points.map(([at, , high]) => [toX(at), toY(high)]), ...points.toReversed().map(([at, low]) => [toX(at), toY(low)])])}Z`,
      }),
    ),
    curves.map(({ points, class: name }) =>
      svg("path", { class: `curve ${name}`, d: path(points.map(([at, value]) => [toX(at), toY(value)])) }),
    ),
  );
  return figure(width, height, label, clip, grid, words, drawn, marks(toX, toY, box));
}
