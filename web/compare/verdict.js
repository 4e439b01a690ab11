// What the server finds between two pictures: whether they are the same within noise, and where not; or the map of what
// an eye would see (FLIP). It takes samples until it is decided, so it is asked again when an edit rests, not with each.

import { amount, count, duration } from "../lib/format-text.js";
import { equal } from "../lib/patch.js";
import { compareMap } from "../server/api.js";
import { problemText } from "../server/problem-text.js";

const CERTAIN = 1e-6; // a p below that leaves no doubt
const TINY = 1e-3; // a p below that is written as a power of ten
const MOST = 0.6; // of what differs: what "mostly" says
const WHOLE = 0.5; // of the picture: what differs over more than that is not somewhere
const VEIL = 150; // of 255: how opaque the map lies over the pictures

const ROWS = ["upper", null, "lower"];
const COLUMNS = ["left", null, "right"];
const ALONE = { upper: "at the top", lower: "at the bottom", left: "at the left", right: "at the right" };

const short = (value) => String(Number(value.toPrecision(2)));
const probability = (p) => (p < TINY ? p.toExponential(0) : short(p));

// "at the upper left": where most of the pixels lie that are known to differ, those of a map that are not black; null
// where they are all over the picture.
export function placeOf({ data, width, height }) {
  const rows = [0, 0, 0];
  const columns = [0, 0, 0];
  let area = 0;
  for (let i = 0; i < width * height; i += 1) {
    if (!isKnown(data, 4 * i)) continue;
    area += 1;
    rows[Math.floor((3 * Math.floor(i / width)) / height)] += 1;
    columns[Math.floor((3 * (i % width)) / width)] += 1;
  }
  if (!area || area > WHOLE * width * height) return null;
  const most = (parts) => parts.findIndex((part) => part > MOST * area);
  const [row, column] = [most(rows), most(columns)];
  if (row === 1 && column === 1) return "in the middle";
  const words = [ROWS[row], COLUMNS[column]].filter(Boolean);
  return words.length === 2 ? `at the ${words.join(" ")}` : (ALONE[words[0]] ?? null);
}

const isKnown = (data, i) => data[i] + data[i + 1] + data[i + 2] > 0;

// How much they differ, of 0 to 1 as displayed.
const step = (difference) => (difference < 0.01 ? "less than 1 %" : `${Math.round(100 * difference)} %`);

// The answer as sentences; `place` as placeOf has it.
export function verdictWords({ different, p_value, differing }, place) {
  if (!different) return "They look the same";
  const told = `They look different: ${p_value < CERTAIN ? "certain" : "almost certain"}.`;
  if (!differing.share) return told; // as a whole, though no single part is known to
  const by = step(differing.difference);
  if (place) return `${told} Most ${place}, ${by} there.`;
  return differing.share > WHOLE ? `${told} Nearly everywhere, by ${by}.` : `${told} In several places, by ${by}.`;
}

export const flipWords = ({ flip }) => `FLIP ${short(flip)}`;

// What is beside it.
export const besideOf = ({ different, samples }) =>
  [...(different ? [] : ["no more than noise"]), ...(samples.b ? [`after ${amount(samples.b, "sample")}`] : [])].join(
    " · ",
  );

// In measures that others know: a tooltip.
export function factsOf({ p_value, flip, ssim, psnr }) {
  return [
    `p = ${probability(p_value)}`,
    flipWords({ flip }),
    `SSIM ${short(ssim)}`,
    ...(psnr === null ? [] : [`PSNR ${psnr.toFixed(1)} dB`]),
  ].join(" · ");
}

// How far the server is, {samples, max_samples}, after some seconds.
export function progressWords({ samples, max_samples }, seconds) {
  if (!samples) return `at most ${amount(max_samples, "sample")}`;
  const left = duration(seconds * (max_samples / samples - 1));
  return `${count(samples)} of at most ${amount(max_samples, "sample")}, ${left} left at most`;
}

// Makes a map's black clear, and the rest such that the pictures are seen through it.
function veiled(image) {
  const { data } = image;
  for (let i = 0; i < data.length; i += 4) data[i + 3] = isKnown(data, i) ? VEIL : 0;
  return image;
}

// The settings of a comparison: of the undenoised picture, as nobody knows the noise of another one.
const sized = ({ scene, settings: { denoise: _, ...settings } }, { width, height }) => ({
  scene,
  settings: { ...settings, width, height },
});

// {verdict, image, place}: a map of certainty for a verdict, else of what an eye sees.
async function answered(kind, a, b, options) {
  const { verdict, blob } = await compareMap(a, b, kind === "verdict" ? "p" : kind, options);
  const bitmap = await createImageBitmap(blob);
  const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  const image = context.getImageData(0, 0, context.canvas.width, context.canvas.height);
  if (kind !== "verdict") return { verdict, image };
  return { verdict, place: placeOf(image), image: veiled(image) };
}

const placeWords = (pointer) => ({ "/a": "The left picture", "/b": "The right picture" })[pointer] ?? "";

export class Question {
  answer = null; // {verdict, image, place}
  problem = ""; // why there is none
  progress = null; // {samples, max_samples, seconds} of one that is awaited
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
    this.changed();
    const began = performance.now();
    const progress = (told) => {
      if (this.#asking !== asking) return;
      this.progress = { ...told, seconds: (performance.now() - began) / 1000 };
      this.changed();
    };
    const [a, b] = subjects.map((subject) => (typeof subject === "string" ? subject : sized(subject, size)));
    try {
      const answer = await answered(kind, a, b, { signal: asking.signal, progress });
      if (asking.signal.aborted) return;
      this.answer = answer;
    } catch (problem) {
      if (asking.signal.aborted) return;
      this.problem = problemText(problem, {}, placeWords);
    }
    this.#asking = this.progress = null;
    this.changed();
  }

  // Closes the connection, which ends the work over there.
  stop() {
    this.#asking?.abort();
    this.#asking = this.progress = null;
  }

  forget() {
    this.stop();
    this.#about = this.answer = null;
    this.problem = "";
  }
}
