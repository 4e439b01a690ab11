// What the keys do, once: the table that obeys them is the sheet that explains them.

const KEY_ORBIT = Math.PI / 36;
const KEY_PAN = 0.05; // of the picture's height
const KEY_ZOOM = 1.1;
const FLY_PER_S = 0.6; // distances to the target

const ARROWS = { arrowleft: [-1, 0], arrowright: [1, 0], arrowup: [0, -1], arrowdown: [0, 1] };
const LIFTS = { pageup: 1, pagedown: -1 };
const FLIGHT = { w: [0, 0, 1], s: [0, 0, -1], a: [-1, 0, 0], d: [1, 0, 0], e: [0, 1, 0], q: [0, -1, 0] };
const BUTTONS = "button, summary, a, [role=option], [role=tab], [role=listbox]";
const WRITING = "input:not([type=range], [type=checkbox]), select, textarea, [contenteditable]";
const MOVING = ["arrowleft", "arrowright", "arrowup", "arrowdown", "home", "end", "pageup", "pagedown"];

// Keys that are held: flying goes on with the display's beat.
class Flight {
  #held = new Set();
  #at = 0;

  constructor(move) {
    this.move = move;
  }

  press(key) {
    if (!this.#held.size) {
      this.#at = performance.now();
      requestAnimationFrame((now) => this.#step(now));
    }
    this.#held.add(key);
  }

  lift(key) {
    if (this.#held.delete(key) && !this.#held.size) this.move.endGesture();
  }

  stop() {
    for (const key of [...this.#held]) this.lift(key);
  }

  #step(now) {
    if (!this.#held.size) return;
    const amount = FLY_PER_S * Math.min(0.1, Math.max(0, now - this.#at) / 1000);
    this.#at = now;
    const sum = [0, 0, 0];
    for (const key of this.#held)
      FLIGHT[key].forEach((x, i) => {
        sum[i] += x * amount;
      });
    if (amount > 0) this.move.fly(...sum);
    requestAnimationFrame((next) => this.#step(next));
  }
}

// `acts`: [{key, shift, ctrl, does, says, group}]; a letter stands for itself, `says` explains it.
export function watchKeys(move, acts) {
  const flight = new Flight(move);
  const inText = ({ target }) => target instanceof Element && target.closest(WRITING);
  // Whether what has the focus needs the key itself.
  const isTaken = (key, { target }) =>
    inText({ target }) ||
    (target.type === "range" && MOVING.includes(key)) ||
    (target.type === "checkbox" && key === " ");

  document.addEventListener("keydown", (event) => {
    const key = event.key.toLowerCase();
    const ctrl = event.ctrlKey || event.metaKey;
    if (event.altKey || document.querySelector("dialog[open]")) return;
    if (key === "escape" && document.querySelector(":popover-open")) return; // closes what is open
    const act = acts.find(
      (each) =>
        each.keys.includes(key) &&
        Boolean(each.ctrl) === ctrl &&
        (each.shift === undefined || each.shift === event.shiftKey),
    );
    if (act?.ctrl) {
      if (event.target.dataset?.dirty || (act.notInText && inText(event))) return;
    } else {
      if (ctrl || isTaken(key, event)) return;
      if ((key === " " || key === "enter" || MOVING.includes(key)) && event.target.closest(BUTTONS)) return;
    }
    const arrow = !ctrl && ARROWS[key];
    if (act) act.does();
    else if (arrow && event.shiftKey) move.pan(arrow[0] * KEY_PAN, arrow[1] * KEY_PAN);
    else if (arrow) move.orbit(arrow[0] * KEY_ORBIT, arrow[1] * KEY_ORBIT);
    else if (!ctrl && (key === "+" || key === "=")) move.zoom(1 / KEY_ZOOM);
    else if (!ctrl && (key === "-" || key === "_")) move.zoom(KEY_ZOOM);
    else if (!ctrl && LIFTS[key] && move.isHandling()) move.lift(LIFTS[key] * (event.shiftKey ? 10 : 1));
    else if (!ctrl && FLIGHT[key]) flight.press(key);
    else return;
    event.preventDefault();
  });
  document.addEventListener("keyup", (event) => {
    const key = event.key.toLowerCase();
    flight.lift(key);
    if (ARROWS[key] || LIFTS[key] || "+=-_".includes(key)) move.endGesture();
  });
  window.addEventListener("blur", () => flight.stop());
}
