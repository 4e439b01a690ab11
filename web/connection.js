// A WebSocket that comes back by itself: with growing pauses, at once when the network or the page returns.

import { PROTOCOL, streamUrl } from "./api.js";

const BACKOFF_MS = [250, 500, 1000, 2000, 4000, 8000];

// A dead network closes nothing: after a silence we ask, and without an answer we give up.
const WATCH_MS = 2500;
const SILENCE_MS = 10000;

// Closings after which trying again by itself is of no use.
const FINAL = { 4403: "The server does not take streams from this page's address." };
const REASONS = {
  1001: "The server is shutting down.",
  1009: "The scene is too large for one message.",
  4429: "The server is full.",
  4500: "The server lost its renderer.",
};

export class Connection {
  #on;
  #socket = null;
  #attempt = 0;
  #timer = 0;
  #heard = 0;
  #asked = 0;

  // `on` has text(message), bytes(buffer), lost(reason, wait_ms; null: no further try).
  constructor(on) {
    this.#on = on;
    setInterval(() => this.#watch(), WATCH_MS);
    window.addEventListener("online", () => this.retry());
    window.addEventListener("pageshow", (event) => { if (event.persisted) this.retry(); });
    document.addEventListener("visibilitychange", () => { if (!document.hidden) this.retry(); });
  }

  open() {
    clearTimeout(this.#timer);
    const socket = new WebSocket(streamUrl(), [PROTOCOL]);
    socket.binaryType = "arraybuffer";
    socket.onmessage = ({ data }) => {
      if (socket !== this.#socket) return;
      this.#heard = performance.now();
      if (typeof data === "string") return this.#on.text(JSON.parse(data));
      this.#attempt = 0; // a server that greets and falls over again is not back yet
      this.#on.bytes(data);
    };
    socket.onclose = (event) => { if (socket === this.#socket) this.#lose(event); };
    this.#socket = socket;
  }

  retry() {
    if (this.#attempt > 0 && (!this.#socket || this.#socket.readyState === WebSocket.CLOSED)) this.open();
  }

  send(value) {
    if (this.#socket?.readyState === WebSocket.OPEN) this.#socket.send(JSON.stringify(value));
  }

  #watch() {
    if (this.#socket?.readyState !== WebSocket.OPEN) return;
    const now = performance.now();
    const unanswered = this.#asked > this.#heard;
    if (unanswered && now - this.#asked > SILENCE_MS) {
      this.#socket.close();
      this.#lose({ code: 1006 });
    } else if (!unanswered && now - this.#heard > SILENCE_MS) {
      this.#asked = now;
      this.send({ type: "ping" });
    }
  }

  #lose({ code, reason }) {
    this.#socket = null;
    this.#asked = 0;
    const longest = BACKOFF_MS[Math.min(this.#attempt++, BACKOFF_MS.length - 1)];
    // Many pages lost at once must not come back at once.
    const wait = FINAL[code] ? null : Math.round(longest * (0.75 + 0.5 * Math.random()));
    if (wait !== null) this.#timer = setTimeout(() => this.open(), wait);
    this.#on.lost(FINAL[code] ?? REASONS[code] ?? reason ?? "", wait);
  }
}
