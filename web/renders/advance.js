// How far a render is, as a bar and a clock are to show it: the server estimates anew with every sample, and a machine
// that others use as well makes these estimates jump.

const SETTLE_S = 20; // in which the shown end moves most of the way to the estimated one
const MOST_PULL = 0.5; // of the way in one step, however long the page was asleep

// The share of the work that is done, by what ends it; null before that can be told.
export function shareOf({ state, samples, noise, elapsed_s, eta_s, settings }) {
  if (state === "done") return 1;
  const { max_samples, time_limit, target_noise } = settings;
  const shares = [
    max_samples && samples / max_samples,
    time_limit && elapsed_s / time_limit,
    target_noise && noise && (target_noise / noise) ** 2,
  ].filter(Number.isFinite);
  if (shares.length) return Math.min(1, Math.max(...shares));
  return eta_s === null ? null : elapsed_s / (elapsed_s + eta_s || 1);
}

export class Advance {
  share = 0; // never falls
  #end = null; // by the page's clock, s
  #at = 0;

  // Call with each status of the render; `now` is the page's clock in seconds.
  take(status, now) {
    this.share = Math.max(this.share, shareOf(status) ?? 0);
    if (status.state !== "running" || status.eta_s === null) {
      this.#end = null;
      return;
    }
    const estimated = now + status.eta_s;
    if (this.#end === null) this.#end = estimated;
    else this.#end += (estimated - this.#end) * Math.min(MOST_PULL, 1 - Math.exp((this.#at - now) / SETTLE_S));
    this.#at = now;
  }

  // The seconds that are left, or null where nobody knows.
  left(now) {
    return this.#end === null ? null : Math.max(0, this.#end - now);
  }
}
