// The quality of a picture in three words, with what they cost this scene at the size that is set; before that is known,
// what the server's price list says.

import { element } from "../lib/dom.js";
import { watchChoice } from "../lib/tabs.js";
import { amount, duration, inWords, percent } from "../lib/format-text.js";

const TRUSTED = 4; // samples before a forecast is worth something
const UNSEEN = 0.0005; // a share of the light that nobody misses

const isKnown = (live) => live?.samples >= TRUSTED && live.scale === 1;

// The presets that the words stand for: what holds where nothing is chosen is "Clean", the next cheaper one is "Fast", and
// the dearest one "Reference". {name: word}
export function words(presets, standard) {
  const names = Object.keys(presets).sort((a, b) => presets[a].max_samples - presets[b].max_samples);
  const at = names.indexOf(standard);
  return { [names[Math.max(0, at - 1)]]: "Fast", [standard]: "Clean", [names.at(-1)]: "Reference" };
}

export const wordOf = (name, presets, standard) => words(presets, standard)[name] ?? inWords(name);

// Seconds and noise of a number of samples at a size, from what the picture on the page has taken so far; without a size
// at the picture's own.
export function forecast(target, { samples, elapsed_s, noise, width, height }, size = null) {
  const more = size ? (size.width * size.height) / (width * height) : 1;
  return {
    seconds: (more * elapsed_s * target) / samples,
    noise: noise === null ? null : noise * Math.sqrt(samples / target),
  };
}

// What a preset, or a number of samples, takes at a size: {seconds, noise, isListed}, or null where nobody knows.
export function priceOf({ max_samples, cost }, { live, size }) {
  if (isKnown(live)) return { ...forecast(max_samples, live, size), isListed: false };
  if (!cost) return null;
  const area = (size.width * size.height) / cost.size ** 2;
  return { seconds: area * cost.seconds, noise: cost.noise, isListed: true };
}

const share = (light) => (light < UNSEEN ? `under ${percent(UNSEEN)}` : percent(light));

// What a preset takes, and what light lies beyond its bounces.
export function taken({ max_samples, max_bounces, cost }) {
  const text = `${amount(max_samples, "sample")}, ${amount(max_bounces, "bounce")}`;
  if (!cost) return text;
  const { missing_light: usual, worst_missing_light: worst } = cost;
  const listed =
    worst.share < UNSEEN ? share(worst.share) : `${share(usual)}, in ${worst.scene} ${percent(worst.share)},`;
  return `${text}; beyond them ${listed} of the listed scenes' light is missing`;
}

// The three words as a choice in `root`; returns what shows them.
export function qualityWords(root, pick) {
  const mark = watchChoice(root, ".quality", (button) => pick(button.dataset.name));
  const lines = new Map(); // by preset: where its time and its noise stand
  let made = null;
  return (presets, { standard, chosen, live, size }) => {
    if (presets !== made) {
      made = presets;
      lines.clear();
      root.replaceChildren(
        ...Object.entries(words(presets, standard)).map(([name, word]) => {
          lines.set(name, { time: element("span", { class: "price" }), noise: element("span", { class: "price" }) });
          return element(
            "button",
            { type: "button", role: "radio", class: "quality", "data-name": name, title: taken(presets[name]) },
            element("span", {}, word),
            ...Object.values(lines.get(name)),
          );
        }),
      );
    }
    for (const [name, place] of lines) {
      const { seconds, noise } = priceOf(presets[name], { live, size }) ?? {};
      const texts = {
        time: seconds === undefined ? amount(presets[name].max_samples, "sample") : `≈ ${duration(seconds)}`,
        noise: typeof noise === "number" ? `${percent(noise)} noise` : "",
      };
      for (const [part, text] of Object.entries(texts))
        if (place[part].textContent !== text) place[part].textContent = text;
    }
    mark((button) => button.dataset.name === chosen);
    // Where none of them is chosen, the Tab key stops at the first.
    if (!lines.has(chosen)) root.querySelector(".quality").tabIndex = 0;
  };
}
