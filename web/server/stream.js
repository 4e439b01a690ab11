// The stream: what is wanted goes out as it changes, frames of the newest generation come in.
//
// One update is under way at a time: the next one leaves when the first frame of the last one has come
// (an update stops the frames before it, so a faster hand would see nothing), or its refusal. Whatever was
// wanted in between is gathered by comparing documents, not by queueing patches.

import { Problem, message, parseFrame } from "./api.js";
import { Connection } from "./connection.js";
import { diff, equal, merge } from "../lib/patch.js";

// A renderer that says nothing for so long (loading, compiling) doesn't hold up the next update.
const PATIENCE_MS = 3000;
const CAPTURE_MS = 20000;
const REMIND_MS = 1500; // until a picture that did not come is asked for again

// Browsers decode pictures by their type; raw numbers have none.
const mimeOf = (format) => (format === "rgba32f" ? "application/octet-stream" : `image/${format}`);

// There is no picture yet of what is wanted, or none at full size.
export class NotReady extends Error {}

export class Stream {
  #on;
  #connection;
  #greeted = false;
  #session = null;
  #generation = 0; // rises over all connections
  #wanted = null; // {scene, settings, view}: what the user wants to see
  #sent = null; // the same, as the server was told; null: it must be told everything
  #document = null; // the scene of #sent as patches have made it over there, where a new name is always the last one
  #valid = null; // the last of which a frame came
  #previous = null; // what an update on its way changes: the server goes on with that if it refuses
  #refused = null; // what the server did not take: not offered again unchanged
  #pending = null; // the timer of an update without an answer
  #halted = { user: false, hidden: document.hidden };
  #told = false; // whether the server was told to pause
  #captures = []; // the first one is under way
  #seen = null; // the view that frames come in; null while that is changing
  #reminder = null;
  #flushing = false;
  #hide = () => this.#halt("hidden", document.hidden);

  // `on` has hello(info), frame(header, bytes, view, acknowledge), waiting(bool), refused(problem, valid),
  // done(message), lost(reason, wait_ms or null).
  constructor(on) {
    this.#on = on;
    this.#connection = new Connection({
      text: (heard) => this.#hear(heard),
      bytes: (buffer) => this.#receive(buffer),
      lost: (reason, wait) => this.#lose(reason, wait),
    });
    document.addEventListener("visibilitychange", this.#hide);
  }

  // The scene with its names in the server's order, by which its layers number them.
  get document() {
    return this.#document;
  }

  connect() {
    this.#connection.open();
  }

  close() {
    document.removeEventListener("visibilitychange", this.#hide);
    this.#endCaptures(new Error("The stream was closed."));
    clearTimeout(this.#pending);
    clearTimeout(this.#reminder);
    this.#connection.close();
    this.#greeted = false;
  }

  // Tries at once instead of waiting for the next turn.
  retry() {
    this.#connection.retry();
  }

  show(wanted) {
    this.#wanted = wanted;
    this.#soon();
  }

  pause() {
    this.#halt("user", true);
  }
  resume() {
    this.#halt("user", false);
  }

  // Whether a picture of this generation shows all that is wanted.
  isNewest(generation) {
    if (!this.#wanted) return false;
    const { scene, settings } = this.#sent ?? {};
    return (
      generation === this.#generation &&
      this.#pending === null &&
      scene === this.#wanted.scene &&
      equal(settings, this.#wanted.settings)
    );
  }

  // The picture as the server has it now, seen otherwise: {header, bytes, scene}. Costs no sample. Raises NotReady
  // after `patience_ms` without one at full size; a preview will do then where it is `rough`.
  capture(view, { patience_ms = CAPTURE_MS, rough = false } = {}) {
    return new Promise((resolve, reject) => {
      if (!this.#sent) return reject(new Error("There is no connection to the server."));
      const capture = { view, resolve, reject, rough, preview: null };
      capture.timer = setTimeout(() => {
        this.#captures = this.#captures.filter((each) => each !== capture);
        if (capture.preview) resolve(capture.preview);
        else reject(new NotReady("One moment: the picture is not ready."));
        this.#tellView();
      }, patience_ms);
      this.#captures.push(capture);
      if (this.#captures.length === 1) this.#tellView();
    });
  }

  #endCaptures(error) {
    for (const { reject, timer } of this.#captures) {
      clearTimeout(timer);
      reject(error);
    }
    this.#captures = [];
  }

  // Frames that were made for an older view are dropped by the server; once it has answered, all are of this one.
  #tellView() {
    if (!this.#sent) return;
    const capture = this.#captures[0];
    // What is kept has no guess in it, and is denoised where the settings say so.
    const view = { ...this.#sent.view, ...(capture && { prior: false, denoise: false, ...capture.view }) };
    this.#seen = null;
    this.#connection.send(message.view(view));
    this.#connection.ask(() => {
      if (capture !== this.#captures[0]) return;
      this.#seen = view;
      // A frame may have slipped through before the answer, and a resting picture sends no second one.
      clearTimeout(this.#reminder);
      this.#reminder = setTimeout(() => this.#tellView(), REMIND_MS);
    });
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
    const flush = () => {
      this.#flushing = false;
      this.#flush();
    };
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
      this.#previous = this.#sent;
      this.#sent = { ...this.#sent, scene, settings };
      this.#document = merge(this.#document, patch.scene ?? {});
      this.#connection.send(message.update(this.#expect(), patch));
    } else if (!this.#pending) this.#sent = { ...this.#sent, scene, settings }; // the same in other words
    if (diff(this.#sent.view, view)) {
      this.#sent = { ...this.#sent, view };
      this.#tellView();
    }
  }

  #start() {
    if (this.#refused && diff(this.#refused, this.#wanted) === undefined) return;
    this.#previous = null;
    this.#sent = this.#wanted;
    this.#document = this.#sent.scene;
    this.#connection.send(message.start(this.#expect(), this.#sent));
    this.#tellView();
  }

  // The generation of an update that is about to leave.
  #expect() {
    this.#pending = setTimeout(() => this.#settle(), PATIENCE_MS);
    this.#on.waiting(true);
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
    this.#on.waiting(false);
    if (this.#pending !== null) this.#settle();
  }

  #hear(heard) {
    const isNewest = heard.generation === this.#generation;
    if (heard.type === "hello") this.#greet(heard);
    else if (heard.type === "error") {
      // The server goes on with the last scene that it took. It is told everything anew: that costs it no
      // more than what has changed, and nothing has to be known here about which scene that was.
      this.#refused = this.#sent ?? this.#refused;
      this.#sent = null;
      this.#on.waiting(false);
      this.#endCaptures(new Error("The server did not take the scene."));
      this.#on.refused(new Problem(heard.problem), (isNewest && this.#previous) || this.#valid);
      this.#previous = null;
      this.#settle();
    } else if (heard.type === "done" && isNewest && this.#sent) {
      this.#answered();
      this.#on.done(heard);
    }
  }

  #greet(hello) {
    const isTakenUp = hello.session !== undefined && hello.session === this.#session && this.#sent !== null;
    this.#session = hello.session;
    this.#connection.keep(hello.session);
    this.#greeted = true;
    this.#told = false;
    if (!isTakenUp) this.#sent = null;
    this.#on.hello(hello, isTakenUp);
    if (isTakenUp) {
      this.#connection.send(message.resume());
      this.#tellView();
      this.#obey();
    }
    this.#soon();
  }

  #receive(buffer) {
    const { header, bytes } = parseFrame(buffer);
    const acknowledge = () => this.#connection.send(message.ack(header.seq));
    if (header.generation !== this.#generation) return acknowledge();
    if (this.#sent) this.#answered();
    const view = this.#seen ?? this.#sent?.view;
    const fits = view && header.mime === mimeOf(view.format);
    const capture = this.#seen && this.#captures[0];
    if (!fits || (!this.#seen && view.format === "rgba32f")) return acknowledge();
    if (this.#seen) clearTimeout(this.#reminder);
    if (!capture) return this.#on.frame(header, bytes, view, acknowledge);
    acknowledge();
    const captured = { header, bytes, scene: this.#sent?.scene };
    if (header.scale < 1 && !this.#halted.user) {
      // a paused picture may never become larger
      if (capture.rough) capture.preview = captured;
      return;
    }
    clearTimeout(capture.timer);
    this.#captures.shift();
    capture.resolve(captured);
    this.#tellView();
  }

  #lose(reason, wait) {
    clearTimeout(this.#pending);
    clearTimeout(this.#reminder);
    this.#greeted = false;
    // What was under way may or may not have been taken: then the server is told everything.
    if (this.#pending !== null || !this.#session) this.#sent = null;
    this.#pending = this.#refused = this.#seen = null;
    this.#endCaptures(new Error("The connection was lost."));
    this.#on.waiting(false);
    this.#on.lost(reason, wait);
  }
}
