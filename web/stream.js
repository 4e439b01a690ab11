// The stream: what is wanted goes out as it changes, frames of the newest generation come in.
//
// One update is under way at a time: the next one leaves when the first frame of the last one has come
// (an update stops the frames before it, so a faster hand would see nothing), or its refusal. Whatever was
// wanted in between is gathered by comparing documents, not by queueing patches.

import { Problem, message, parseFrame } from "./api.js";
import { Connection } from "./connection.js";
import { diff } from "./patch.js";

// A renderer that says nothing for so long (loading, compiling) doesn't hold up the next update.
const PATIENCE_MS = 3000;
const CAPTURE_MS = 20000;

export class Stream {
  #on;
  #connection;
  #greeted = false;
  #generation = 0; // rises over all connections
  #wanted = null; // {scene, settings, view}: what the user wants to see
  #sent = null; // the same, as the server was told; null: it must be told everything
  #valid = null; // the last of which a frame came
  #refused = null; // what the server did not take: not offered again unchanged
  #pending = null; // the timer of an update without an answer
  #halted = { user: false, hidden: document.hidden };
  #told = false; // whether the server was told to pause
  #capture = null;
  #flushing = false;

  // `on` has hello(info), frame(header, blob, acknowledge), refused(problem, valid), done(message),
  // lost(reason, wait_ms or null).
  constructor(on) {
    this.#on = on;
    this.#connection = new Connection({
      text: (heard) => this.#hear(heard),
      bytes: (buffer) => this.#receive(buffer),
      lost: (reason, wait) => this.#lose(reason, wait),
    });
    document.addEventListener("visibilitychange", () => this.#halt("hidden", document.hidden));
  }

  connect() { this.#connection.open(); }

  // Tries at once instead of waiting for the next turn.
  retry() { this.#connection.retry(); }

  show(wanted) {
    this.#wanted = wanted;
    this.#soon();
  }

  pause() { this.#halt("user", true); }
  resume() { this.#halt("user", false); }

  // The picture as the server has it now, as a PNG: {header, blob}.
  capture() {
    this.#endCapture(new Error("Another picture was asked for."));
    return new Promise((resolve, reject) => {
      if (!this.#sent) return reject(new Error("There is no connection to the server."));
      const timer = setTimeout(() => this.#endCapture(new Error("The server sent no picture.")), CAPTURE_MS);
      this.#capture = { resolve, reject, timer };
      this.#tellView();
    });
  }

  #endCapture(error, picture) {
    if (!this.#capture) return;
    const { resolve, reject, timer } = this.#capture;
    clearTimeout(timer);
    this.#capture = null;
    if (error) reject(error);
    else resolve(picture);
    if (this.#sent) this.#tellView();
  }

  #tellView() {
    const format = this.#capture ? { format: "png" } : {};
    this.#connection.send(message.view({ ...this.#sent.view, ...format }));
  }

  #halt(reason, on) {
    this.#halted[reason] = on;
    this.#obey();
  }

  // Pauses and resumes. Not before the first frame of an update: a paused page shows a picture, too.
  #obey() {
    const halted = this.#halted.user || this.#halted.hidden;
    if (!this.#sent || halted === this.#told || (halted && this.#pending)) return;
    this.#told = halted;
    this.#connection.send(halted ? message.pause() : message.resume());
  }

  #soon() {
    if (this.#flushing) return;
    this.#flushing = true;
    const flush = () => { this.#flushing = false; this.#flush(); };
    // Hidden pages get no animation frames.
    if (document.hidden) setTimeout(flush);
    else requestAnimationFrame(flush);
  }

  #flush() {
    if (!this.#greeted || !this.#wanted) return;
    if (!this.#sent) return this.#start();
    const { scene, settings, view } = this.#wanted;
    const patch = { scene: diff(this.#sent.scene, scene), settings: diff(this.#sent.settings, settings) };
    if (!this.#pending && (patch.scene !== undefined || patch.settings !== undefined)) {
      this.#sent = { ...this.#sent, scene, settings };
      this.#connection.send(message.update(this.#expect(), patch));
    }
    if (diff(this.#sent.view, view)) {
      this.#sent = { ...this.#sent, view };
      this.#tellView();
    }
  }

  #start() {
    if (this.#refused && diff(this.#refused, this.#wanted) === undefined) return;
    this.#sent = this.#wanted;
    this.#connection.send(message.start(this.#expect(), this.#sent));
  }

  // The generation of an update that is about to leave.
  #expect() {
    this.#pending = setTimeout(() => this.#settle(), PATIENCE_MS);
    return ++this.#generation;
  }

  #settle() {
    clearTimeout(this.#pending);
    this.#pending = null;
    this.#obey();
    this.#soon();
  }

  #answered() {
    this.#valid = this.#sent;
    this.#refused = null;
    if (this.#pending !== null) this.#settle();
  }

  #hear(heard) {
    const isNewest = heard.generation === this.#generation;
    if (heard.type === "hello") {
      this.#greeted = true;
      this.#told = false;
      this.#on.hello(heard);
      this.#soon();
    } else if (heard.type === "error") {
      // The server goes on with the last scene that it took. It is told everything anew: that costs it no
      // more than what has changed, and nothing has to be known here about which scene that was.
      this.#refused = this.#sent ?? this.#refused;
      this.#sent = null;
      this.#on.refused(new Problem(heard.problem), this.#valid);
      this.#settle();
    } else if (heard.type === "done" && isNewest && this.#sent) {
      this.#answered();
      this.#on.done(heard);
    }
  }

  #receive(buffer) {
    const { header, blob } = parseFrame(buffer);
    const acknowledge = () => this.#connection.send(message.ack(header.seq));
    if (header.generation !== this.#generation) return acknowledge();
    if (this.#sent) this.#answered();
    const isWhole = header.scale === 1 || this.#halted.user; // a paused picture may never become larger
    if (header.mime === "image/png" && isWhole) this.#endCapture(null, { header, blob });
    this.#on.frame(header, blob, acknowledge);
  }

  #lose(reason, wait) {
    clearTimeout(this.#pending);
    this.#greeted = false;
    this.#pending = this.#sent = this.#refused = null;
    this.#endCapture(new Error("The connection was lost."));
    this.#on.lost(reason, wait);
  }
}
