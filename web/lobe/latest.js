// Work of which only the newest matters: one piece is under way at a time, and the newest that was wanted meanwhile is
// next. A piece is never cut off before its first result, so that a hand that keeps moving keeps seeing curves.

export class Latest {
  #next = null;
  #isRunning = false;

  // `work(isStale)` may look whether it should end early. Resolves when everything wanted so far has ended.
  async want(work) {
    this.#next = work;
    if (this.#isRunning) return;
    this.#isRunning = true;
    try {
      while (this.#next) {
        const now = this.#next;
        this.#next = null;
        await now(() => this.#next !== null);
      }
    } finally {
      this.#isRunning = false;
    }
  }
}
