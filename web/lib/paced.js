// Work that is asked for more often than it is done: at once the first time, then with a rest after each time, and once
// more after the last time that it was asked for, so that nothing that came during a rest is missed.

export class Paced {
  #endedAt = -Infinity;
  #timer = null;
  #isBusy = false;
  #isAsked = false;

  // `work()` may be asynchronous.
  constructor(rest_ms, work) {
    Object.assign(this, { rest_ms, work });
  }

  ask() {
    if (this.#isBusy) this.#isAsked = true;
    else this.#timer ??= setTimeout(() => this.#do(), this.#endedAt + this.rest_ms - performance.now());
  }

  // The next time needs no rest before it.
  hurry() {
    this.#endedAt = -Infinity;
  }

  async #do() {
    this.#timer = null;
    this.#isBusy = true;
    this.#isAsked = false;
    try {
      await this.work();
    } finally {
      this.#isBusy = false;
      this.#endedAt = performance.now();
      if (this.#isAsked) this.ask();
    }
  }
}
