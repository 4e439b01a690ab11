// The quality presets with what they cost this scene, here and now; before that is known, what the price list says.

import { element } from "../lib/dom.js";
import { watchChoice } from "../lib/tabs.js";
import { amount, duration, inWords, percent } from "../lib/format-text.js";

const TRUSTED = 4; // samples before a forecast is worth something
const UNSEEN = 0.0005; // a share of the light that nobody misses

const isKnown = (live) => live?.samples >= TRUSTED && live.scale === 1;

// The time and noise that a number of samples comes to, from what the picture has taken so far.
export function forecast(target, { samples, elapsed_s, noise }) {
  return {
    seconds: (elapsed_s * target) / samples,
    noise: noise === null ? null : noise * Math.sqrt(samples / target),
  };
}

// What a preset costs. `live`: the header of the newest frame.
export function price(preset, live) {
  const { seconds, noise } = isKnown(live) ? forecast(preset.max_samples, live) : (preset.cost ?? {});
  if (typeof seconds !== "number") return "";
  const reached = typeof noise === "number" ? ` to ${percent(noise)} noise` : "";
  return isKnown(live) ? `≈ ${duration(seconds)}${reached} here` : `listed: ${duration(seconds)}${reached}`;
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

export function qualityChoice(root, pick) {
  const mark = watchChoice(root, ".quality", (button) => pick(button.dataset.name));
  const places = new Map();
  let made = null;
  return (presets, chosen, live) => {
    if (presets !== made) {
      made = presets;
      places.clear();
      root.replaceChildren(
        ...Object.keys(presets).map((name) => {
          places.set(name, { price: element("span", { class: "price" }), taken: element("span", { class: "what" }) });
          return element(
            "button",
            { type: "button", role: "radio", class: "quality", "data-name": name },
            element("span", {}, inWords(name)),
            ...Object.values(places.get(name)),
          );
        }),
      );
    }
    for (const [name, place] of places) {
      const texts = { price: price(presets[name], live), taken: taken(presets[name]) };
      for (const [part, text] of Object.entries(texts))
        if (place[part].textContent !== text) place[part].textContent = text;
    }
    mark((button) => button.dataset.name === chosen);
  };
}
