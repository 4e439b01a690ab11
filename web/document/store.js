// What the user wants: one immutable value, its listeners, and the way back.

import { equal } from "../lib/patch.js";

const DEPTH = 200;

export class Store {
  #listeners = [];
  #past = [];
  #future = [];
  #gesture = null;

  constructor(state) {
    this.state = state;
  }

  subscribe(listener) {
    this.#listeners.push(listener);
  }

  // Takes over some members of the state. Changes of one gesture (a drag, a key held down) are
  // undone together: they follow one another with the same name and without `seal` between them.
  change(members, gesture = null) {
    if (gesture === null || gesture !== this.#gesture) {
      this.#past = [...this.#past.slice(1 - DEPTH), this.state];
      this.#future = [];
    }
    this.#gesture = gesture;
    this.#set({ ...this.state, ...members });
  }

  // A change that nobody made by hand (a refused value taken back, a new window size): not undone.
  amend(members) {
    this.#set({ ...this.state, ...members });
  }

  seal() {
    this.#gesture = null;
  }

  get canUndo() {
    return this.#past.length > 0;
  }

  get canRedo() {
    return this.#future.length > 0;
  }

  undo() {
    this.#travel(this.#past, this.#future);
  }

  redo() {
    this.#travel(this.#future, this.#past);
  }

  #travel(from, to) {
    // A change that was refused and taken back left nothing to undo.
    while (from.length && equal(from.at(-1), this.state)) from.pop();
    if (!from.length) return this.#set(this.state);
    to.push(this.state);
    this.seal();
    this.#set(from.pop());
  }

  #set(state) {
    this.state = state;
    for (const listener of this.#listeners) listener(state);
  }
}
