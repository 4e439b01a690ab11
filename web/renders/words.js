// A render in words.

import { amount, count, duration, percent, sentence } from "../lib/format-text.js";
import { times } from "./sizes.js";

const dayOf = (date) => date.toDateString();

// "14:32", or "3 Nov, 14:32" on another day.
export function momentOf(created, now = new Date()) {
  const date = new Date(created);
  const time = date.toLocaleTimeString("en-GB", { hour: "2-digit", minute: "2-digit" });
  if (dayOf(date) === dayOf(now)) return time;
  return `${date.toLocaleDateString("en-GB", { day: "numeric", month: "short" })}, ${time}`;
}

// What it is called: its label, or when it began.
export const titleOf = ({ label, created }) => label || (created ? `Render of ${momentOf(created)}` : "Render");

// Its state: "Rendering, 44 %, 2 min left".
export function stateOf({ state, samples, reason, problem, advance }, left) {
  if (state === "queued") return samples ? "Waits to go on" : "Waits for its turn";
  if (state === "failed") return `Failed. ${sentence(problem?.detail ?? reason ?? "")}`.trim();
  if (state === "cancelled") return samples ? `Stopped at ${Math.round(100 * advance.share)}\u00a0%` : "Stopped";
  if (state === "done") return "Done";
  if (!samples) return "Preparing";
  const parts = ["Rendering", `${Math.floor(100 * advance.share)}\u00a0%`];
  return [...parts, ...(left === null ? [] : [`${duration(left)} left`])].join(", ");
}

// What it is: size, samples, noise, time.
export function factsOf({ settings, samples, noise, elapsed_s, state }) {
  const { width, height, max_samples } = settings;
  const isEnded = state !== "queued" && state !== "running";
  const taken = isEnded || !max_samples ? amount(samples, "sample") : `${count(samples)} / ${count(max_samples)}`;
  return [
    times(width, height),
    ...(samples ? [taken] : []),
    ...(samples && noise !== null ? [`${percent(noise)} noise`] : []),
    ...(samples ? [duration(elapsed_s)] : []),
  ];
}
