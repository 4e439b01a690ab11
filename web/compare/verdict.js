// What the server finds between two pictures: whether they are the same within noise, and where not; or the map of what
// an eye would see (FLIP). It takes samples until it is decided, so it is asked for once and not again with every edit.

import { amount } from "../lib/format-text.js";
import { equal } from "../lib/patch.js";
import { compare, compareMap } from "../server/api.js";
import { problemText } from "../server/problem-text.js";

const LEAST = 1e-290; // the server gives no p below about 1e-300: one near that is as good as none
const TINY = 1e-3; // a p below that is written as a power of ten
const MOST = 0.6; // of what differs: what "mostly" says
const WHOLE = 0.5; // of the picture: what differs over more than that is not somewhere

const ROWS = ["upper", null, "lower"];
const COLUMNS = ["left", null, "right"];
const ALONE = { upper: "at the top", lower: "at the bottom", left: "at the left", right: "at the right" };

const short = (value) => String(Number(value.toPrecision(2)));
const probability = (p) => (p < TINY ? p.toExponential(0) : short(p));

// How much of [from, to) lies in each third of 0..1.
const thirds = (from, to) => [0, 1, 2].map((i) => Math.max(0, Math.min(to, (i + 1) / 3) - Math.max(from, i / 3)));

// "in the upper left": where most of the differing regions is; null where that is all over the picture.
export function placeOf(regions, { width, height }) {
  const rows = [0, 0, 0];
  const columns = [0, 0, 0];
  for (const region of regions) {
    const [across, down] = [region.width / width, region.height / height];
    thirds(region.y / height, region.y / height + down).forEach((part, i) => (rows[i] += part * across));
    thirds(region.x / width, region.x / width + across).forEach((part, i) => (columns[i] += part * down));
  }
  const area = rows.reduce((sum, part) => sum + part, 0);
  if (!area || area > WHOLE) return null;
  const most = (parts) => parts.findIndex((part) => part > MOST * area);
  const [row, column] = [most(rows), most(columns)];
  if (row === 1 && column === 1) return "in the middle";
  const words = [ROWS[row], COLUMNS[column]].filter(Boolean);
  return words.length === 2 ? `in the ${words.join(" ")}` : (ALONE[words[0]] ?? null);
}

// The answer as a sentence.
export function verdictWords({ different, p_value, regions }, size) {
  if (!different) return "The same within noise";
  const place = placeOf(regions, size);
  const p = p_value <= LEAST ? "p is practically 0" : `p = ${probability(p_value)}`;
  return `Different: ${[p, ...(place ? [`mostly ${place}`] : [])].join(", ")}`;
}

export const flipWords = ({ flip }) => `FLIP ${short(flip)}`;

// What is beside it: how much, in measures that others know.
export function factsOf({ flip, ssim, psnr, samples }) {
  return [
    flipWords({ flip }),
    `SSIM ${short(ssim)}`,
    ...(psnr === null ? [] : [`PSNR ${psnr.toFixed(1)} dB`]),
    ...(samples.b ? [`of ${amount(samples.b, "sample")}`] : []),
  ].join(" · ");
}

// Draws the outlines of regions of a picture of `size` over one that is as high as the canvas.
export function drawRegions(canvas, regions, size) {
  const context = canvas.getContext("2d");
  const zoom = canvas.height / size.height;
  const left = (canvas.width - size.width * zoom) / 2;
  context.clearRect(0, 0, canvas.width, canvas.height);
  for (const [style, line] of [
    ["#000", 4],
    ["#fff", 2],
  ]) {
    context.strokeStyle = style;
    context.lineWidth = line;
    for (const { x, y, width, height } of regions)
      context.strokeRect(left + x * zoom, y * zoom, width * zoom, height * zoom);
  }
}

// The settings of a comparison: of the undenoised picture, as nobody knows the noise of another one.
const sized = ({ scene, settings: { denoise: _, ...settings } }, { width, height }) => ({
  scene,
  settings: { ...settings, width, height },
});

async function answered(kind, a, b, signal) {
  if (kind === "verdict") return { verdict: await compare(a, b, signal) };
  const { verdict, blob } = await compareMap(a, b, kind, signal);
  return { verdict, map: await createImageBitmap(blob) };
}

const placeWords = (pointer) => ({ "/a": "The left picture", "/b": "The right picture" })[pointer] ?? "";

export class Question {
  answer = null; // {verdict} and, of "flip", {map}
  problem = ""; // why there is none
  size = null; // of what was compared
  #about = null; // {kind, subjects, names}
  #asking = null;

  // `changed()` is called when something else is to be said.
  constructor({ changed }) {
    this.changed = changed;
  }

  get isAsking() {
    return this.#asking !== null;
  }

  // Whether what was asked last was of this kind, about what has these names.
  isAbout(kind, names) {
    return this.#about?.kind === kind && equal(this.#about.names, names);
  }

  // Whether something has been edited since.
  isOutdated(subjects) {
    return this.#about !== null && !equal(this.#about.subjects, subjects);
  }

  // `kind`: "verdict" or "flip"; `subjects` of both sides, and the `names` of these.
  async ask(kind, subjects, names, size) {
    this.forget();
    const asking = new AbortController();
    this.#asking = asking;
    this.#about = { kind, subjects, names };
    this.size = size;
    this.changed();
    const [a, b] = subjects.map((subject) => (typeof subject === "string" ? subject : sized(subject, size)));
    try {
      const answer = await answered(kind, a, b, asking.signal);
      if (asking.signal.aborted) return;
      this.answer = answer;
    } catch (problem) {
      if (asking.signal.aborted) return;
      this.problem = problemText(problem, {}, placeWords);
    }
    this.#asking = null;
    this.changed();
  }

  // Closes the connection, which ends the work over there.
  stop() {
    this.#asking?.abort();
    this.#asking = null;
  }

  forget() {
    this.stop();
    this.#about = this.answer = null;
    this.problem = "";
  }
}
