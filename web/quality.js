// The quality presets with what they cost: as the server measured it, and as this scene goes here and now.

import { element } from "./dom.js";
import { watchChoice } from "./tabs.js";
import { count, duration, inWords, percent } from "./words.js";

const TRUSTED = 4; // samples before a forecast is worth something

// The time and noise that a number of samples comes to, from what the picture has taken so far.
export function forecast(target, { samples, elapsed_s, noise }) {
  return {
    seconds: (elapsed_s * target) / samples,
    noise: noise === null ? null : noise * Math.sqrt(samples / target),
  };
}

function price(preset, live) {
  const known = live?.samples >= TRUSTED && live.scale === 1;
  const { seconds, noise } = known ? forecast(preset.max_samples, live) : preset.cost ?? {};
  if (typeof seconds !== "number") return "";
  const missing = known ? live.missing_light?.[preset.max_bounces] : undefined; // of this scene's light, once measured
  return [
    `≈ ${duration(seconds)}`,
    typeof noise === "number" ? `${percent(noise)} noise` : "",
    typeof missing === "number" ? (missing < 0.0005 ? "no light missing" : `${percent(missing)} of the light missing`) : "",
  ].filter(Boolean).join(", ");
}

const basics = ({ max_samples, max_bounces }) => `${count(max_samples)} samples, ${max_bounces} bounces`;

export function qualityChoice(root, pick) {
  const mark = watchChoice(root, ".quality", (button) => pick(button.dataset.name));
  const prices = new Map();
  let made = null;
  return (presets, chosen, live) => {
    if (presets !== made) {
      made = presets;
      prices.clear();
      root.replaceChildren(...Object.entries(presets).map(([name, preset]) => {
        prices.set(name, element("span", { class: "price" }));
        return element(
          "button", { type: "button", role: "radio", class: "quality", "data-name": name },
          element("span", {}, inWords(name)), prices.get(name),
          element("span", { class: "what" }, [basics(preset), preset.gives_up].filter(Boolean).join(". ")),
        );
      }));
    }
    for (const [name, place] of prices) {
      const text = price(presets[name], live);
      if (place.textContent !== text) place.textContent = text;
    }
    mark((button) => button.dataset.name === chosen);
  };
}
