// The quality presets with what they cost and how far they come, as the server measured it.

import { element } from "./dom.js";
import { watchChoice } from "./tabs.js";
import { count, inWords } from "./words.js";

const FIGURES = {
  cost: (x) => `${Number(x.toPrecision(2))}× the time`,
  seconds: (x) => `${Number(x.toPrecision(2))} s`,
  error: (x) => `error ${Number((100 * x).toPrecision(2))} %`,
};

// What a preset says of its price, in whatever of these terms the server measured.
export function price(preset) {
  return Object.entries(FIGURES)
    .filter(([name]) => typeof preset[name] === "number")
    .map(([name, words]) => words(preset[name])).join(" · ");
}

const bounces = (n) => (n === undefined ? "" : `, ${n} bounces`);

export function qualityChoice(root, pick) {
  const mark = watchChoice(root, ".quality", (button) => pick(button.dataset.name));
  let made = null;
  return (presets, chosen) => {
    if (presets !== made) {
      made = presets;
      root.replaceChildren(...Object.entries(presets).map(([name, preset]) => element(
        "button", { type: "button", role: "radio", class: "quality", "data-name": name },
        element("span", {}, inWords(name)), element("span", { class: "price" }, price(preset)),
        element("span", { class: "what" }, `${count(preset.max_samples)} samples${bounces(preset.max_bounces)}`),
      )));
    }
    mark((button) => button.dataset.name === chosen);
  };
}
