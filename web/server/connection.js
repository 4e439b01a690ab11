// A WebSocket that comes back by itself: with growing pauses, at once when the network or the page returns.

import { message, streamProtocols, streamUrl } from "./api.js";

const BACKOFF_MS = [250, 500, 1000, 2000, 4000, 8000];

// A dead network closes nothing: after a silence we ask, and without an answer we give up.
const WATCH_MS = 2500;
const SILENCE_MS = 10000;

const GONE = 4404; // the session that was to be taken up again
const FULL_MS = 5000; // between two questions whether there is room

// What happened and what to do, by close code. `final`: trying again by itself is of no use.
const REASONS = {
  1001: { title: "The server is shutting down.", detail: "This page comes back with it." },
  1009: {
    title: "The scene is too large for one message.",
    detail: "Drop big meshes as files instead of writing them out; undo goes back.",
    final: true,
  },
  4401: { title: "The server asks for a key.", final: true, key: true },
  4403: {
    title: "The server does not accept this page's address.",
    detail: "Whoever runs it can allow the address by SUNBOX_ALLOWED_ORIGINS.",
    final: true,
  },
  4409: {
    title: "This session goes on in another tab.",
    detail: "Continue there, or take a new one here.",
    final: true,
  },
  4429: {
    title: "The server is full.",
    detail: "Your scene is safe here; the picture comes as soon as somebody leaves.",
    full: true,
  },
  4500: { title: "The renderer stopped.", detail: "Your scene is safe here." },
};
const LOST = { title: "The connection to the server was lost.", detail: "Your scene is safe here." };

export class Connection {
  #on;
  #socket = null;
  #session = null;
  #attempt = 0;
  #timer = 0;
  #heard = 0;
  #watched = null; // when an answer was asked for
  #questions = []; // called one by one, with each pong
  #closed = false;

  // `on` has text(message), bytes(buffer), lost(reason {title, detail, key}, wait_ms; null: no further try).
  constructor(on) {
    this.#on = on;
    this.watch = setInterval(() => this.#watch(), WATCH_MS);
    window.addEventListener("online", () => this.retry());
    window.addEventListener("pageshow", (event) => {
      if (event.persisted) this.retry();
    });
    document.addEventListener("visibilitychange", () => {
      if (!document.hidden) this.retry();
    });
  }

  open() {
    clearTimeout(this.#timer);
    const socket = new WebSocket(streamUrl(this.#session), streamProtocols());
    socket.binaryType = "arraybuffer";
    socket.onmessage = ({ data }) => {
      if (socket !== this.#socket) return;
      this.#heard = performance.now();
      if (typeof data !== "string") {
        this.#attempt = 0; // a server that greets and falls over again is not back yet
        return this.#on.bytes(data);
      }
      const heard = JSON.parse(data);
      if (heard.type === "pong") this.#questions.shift()?.();
      else this.#on.text(heard);
    };
    socket.onclose = (event) => {
      if (socket === this.#socket) this.#lose(event);
    };
    this.#socket = socket;
  }

  // For good: another connection would have to be made.
  close() {
    clearTimeout(this.#timer);
    clearInterval(this.watch);
    this.#closed = true;
    const socket = this.#socket;
    this.#socket = null;
    socket?.close();
  }

  // The session that the next opening takes up again.
  keep(session) {
    this.#session = session ?? null;
  }

  retry() {
    if (this.#closed || this.#attempt === 0) return;
    if (!this.#socket || this.#socket.readyState === WebSocket.CLOSED) this.open();
  }

  send(value) {
    if (this.#socket?.readyState === WebSocket.OPEN) this.#socket.send(JSON.stringify(value));
  }

  // Calls back once everything that was sent before has been taken.
  ask(answered) {
    this.#questions.push(answered);
    this.send(message.ping());
  }

  #watch() {
    if (this.#socket?.readyState !== WebSocket.OPEN) return;
    const now = performance.now();
    if (this.#watched !== null && this.#heard < this.#watched) {
      if (now - this.#watched < SILENCE_MS) return;
      this.#socket.close();
      this.#lose({ code: 1006 });
    } else if (now - this.#heard > SILENCE_MS) {
      this.#watched = now;
      this.ask(() => {});
    }
  }

  #lose({ code, reason }) {
    this.#socket = null;
    this.#watched = null;
    this.#questions = [];
    if (code === GONE && this.#session) {
      this.#session = null;
      return this.open();
    }
    const known = REASONS[code] ?? { ...LOST, detail: reason || LOST.detail };
    const longest = code === 4429 ? FULL_MS : BACKOFF_MS[Math.min(this.#attempt, BACKOFF_MS.length - 1)];
    this.#attempt += 1;
    if (code === 4409) this.#session = null;
    // Many pages lost at once must not come back at once.
    const wait = known.final ? null : Math.round(longest * (0.75 + 0.5 * Math.random()));
    if (wait !== null) this.#timer = setTimeout(() => this.open(), wait);
    this.#on.lost(known, wait);
  }
}
