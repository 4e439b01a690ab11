// How long things took the last times, as the browser remembers it: what one of them may take this time.

const MOST = 12; // seconds that are remembered of a kind
const MOST_KINDS = 32;

const median = (sorted) => sorted[Math.floor(sorted.length / 2)];

export class Durations {
  // `name` is where they are stored.
  constructor(name) {
    this.name = name;
  }

  #read() {
    try {
      return JSON.parse(localStorage.getItem(this.name)) ?? {};
    } catch {
      return {}; // no storage, or somebody else's
    }
  }

  add(kind, seconds) {
    const { [kind]: before = [], ...others } = this.#read();
    const kept = Object.entries(others).slice(1 - MOST_KINDS);
    const all = { ...Object.fromEntries(kept), [kind]: [...before, Number(seconds.toFixed(1))].slice(-MOST) };
    try {
      localStorage.setItem(this.name, JSON.stringify(all));
    } catch {
      // Storage is full or forbidden: the next time nothing is expected.
    }
  }

  // The seconds that one takes which has taken some already: the median of those of its kind that took longer, or null.
  // The first of the kinds decides that has any.
  expected(kinds, taken) {
    const known = this.#read();
    const longer = kinds.map((kind) => (known[kind] ?? []).filter((each) => each > taken).sort((a, b) => a - b));
    return median(longer.find((each) => each.length) ?? []) ?? null;
  }
}
