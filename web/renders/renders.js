// The renders of this user, as the server has them: they go on when this page is closed, and are listed again by the
// next one.

import * as api from "../server/api.js";
import { Advance } from "./advance.js";

const PAGE = 30; // renders that are listed at first, and with each "more"
const WATCH_MS = 1000; // between two looks at what is under way
const AWAY_MS = 4000; // while the server does not answer
const MOST_WATCHED = 8; // of those under way; when one ends, all are looked at
const REGRET_MS = 6000; // in which a deletion is taken back

const ENDED = ["done", "cancelled", "failed"];
const GONE = [404, 410];

export const isEnded = ({ state }) => ENDED.includes(state);
export const hasPicture = ({ samples, state }) => samples > 0 && state !== "failed";

const clock = () => performance.now() / 1000;
const pause = (ms) =>
  new Promise((wake) => {
    setTimeout(wake, ms);
  });
const freshKey = () => [...crypto.getRandomValues(new Uint8Array(16))].map((x) => x.toString(16)).join("-");

export class Renders {
  entries = []; // the statuses, each with its `advance`; the newest first
  hasMore = false;
  #advances = new Map(); // by id
  #leaving = new Map(); // by id: the timers of those to be deleted
  #isWatching = false;
  #turn = 0; // rises with each change: a list that was asked for before it is dropped

  // `changed()` is called after each change of `entries`, `ended(render)` where one ends, `forgotten(ids)` with those
  // that are no longer there.
  constructor({ changed, ended, forgotten }) {
    Object.assign(this, { changed, ended, forgotten });
    addEventListener("pagehide", () => this.#deleteNow());
    document.addEventListener("visibilitychange", () => this.#watch());
  }

  // Reads the list from the server; raises what went wrong.
  async refresh() {
    const turn = ++this.#turn;
    const limit = Math.min(200, Math.max(PAGE, this.entries.length));
    const { renders, hasMore } = await api.listRenders({ limit });
    if (turn !== this.#turn) return;
    this.hasMore = hasMore;
    this.#show(renders);
  }

  async more() {
    const turn = ++this.#turn;
    const { renders, hasMore } = await api.listRenders({ limit: PAGE, after: this.entries.at(-1).id });
    if (turn !== this.#turn) return;
    this.hasMore = hasMore;
    this.#show([...this.entries, ...renders]);
  }

  // Starts a render; raises what the server refused. `order`: {scene, settings, label, ...}; `accepted(status)` is called
  // before it is listed.
  async submit(order, accepted) {
    const status = await api.submitRender(order, freshKey());
    accepted(status);
    this.#turn += 1;
    this.#show([status, ...this.entries.filter(({ id }) => id !== status.id)]);
  }

  // Stops one that is under way; the picture so far stays.
  async stop(id) {
    await api.deleteRender(id);
    await this.#look(id);
  }

  // Takes one out of the list, stops it, and deletes it a little later. Returns what takes the deletion back.
  remove(render) {
    const { id } = render;
    if (!isEnded(render)) api.deleteRender(id).catch(() => {}); // that stops it; if not, deleting it does
    const timer = setTimeout(() => this.#delete(id), REGRET_MS);
    this.#leaving.set(id, timer);
    this.#show(this.entries);
    return () => {
      clearTimeout(timer);
      if (this.#leaving.delete(id)) this.refresh().catch(() => {});
    };
  }

  async #delete(id, options = {}) {
    this.forgotten([id]);
    // Where it fails, it was deleted elsewhere, or the server is away and the next list has it again.
    await api.deleteRender(id, options).catch(() => {});
    this.#leaving.delete(id);
  }

  #deleteNow() {
    for (const [id, timer] of this.#leaving) {
      clearTimeout(timer);
      this.#delete(id, { keepalive: true });
    }
  }

  #show(statuses) {
    const before = new Map(this.entries.map((each) => [each.id, each]));
    this.entries = statuses
      .filter(({ id }) => !this.#leaving.has(id))
      .map((status) => {
        if (!this.#advances.has(status.id)) this.#advances.set(status.id, new Advance());
        const advance = this.#advances.get(status.id);
        if (before.get(status.id) !== status) advance.take(status, clock());
        return { ...status, advance };
      });
    this.changed();
    for (const render of this.entries)
      if (isEnded(render) && before.has(render.id) && !isEnded(before.get(render.id))) this.ended(render);
    this.#watch();
  }

  // The seconds that one has left, or null.
  left({ advance }) {
    return advance.left(clock());
  }

  // --- what is under way ---

  async #watch() {
    if (this.#isWatching) return;
    this.#isWatching = true;
    while (!document.hidden && this.#underWay().length) {
      await pause(WATCH_MS);
      for (const { id } of this.#underWay()) if (!(await this.#look(id))) await pause(AWAY_MS);
    }
    this.#isWatching = false;
  }

  // Those that run, and of those that wait the oldest, which are next.
  #underWay() {
    const running = this.entries.filter(({ state }) => state === "running");
    const queued = this.entries.filter(({ state }) => state === "queued").reverse();
    return [...running, ...queued].slice(0, MOST_WATCHED);
  }

  // Looks at one; false where the server does not answer.
  async #look(id) {
    const turn = this.#turn;
    try {
      const status = await api.renderStatus(id);
      if (turn === this.#turn) this.#show(this.entries.map((each) => (each.id === id ? status : each)));
    } catch (problem) {
      if (!GONE.includes(problem.status)) return false;
      this.#turn += 1;
      this.#show(this.entries.filter((each) => each.id !== id));
      this.forgotten([id]);
    }
    return true;
  }
}
