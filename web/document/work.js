// The work itself, from one visit to the next. Every tab keeps its own, under a name that outlives a reload of the
// tab; a new tab begins with what was worked on last.

const TAB = "sunbox.tab"; // in sessionStorage: this tab's name
const WORK = "sunbox.work "; // in localStorage, followed by a tab's name: {saved, ...essence}
const MOST = 8; // tabs whose work is remembered

const fresh = () =>
  [...crypto.getRandomValues(new Uint8Array(8))].map((x) => x.toString(16).padStart(2, "0")).join("");

let tab = null;

// Resolves to false where another tab has the name: a tab that was duplicated came with a copy of it.
function isAlone(name) {
  if (!navigator.locks) return Promise.resolve(true); // only pages from elsewhere by plain http lack it
  return new Promise((resolve) => {
    navigator.locks.request(WORK + name, { ifAvailable: true }, (lock) => {
      resolve(lock !== null);
      return lock && new Promise(() => {}); // as long as the page lives
    });
  });
}

const read = (name) => {
  try {
    return JSON.parse(localStorage.getItem(WORK + name));
  } catch {
    return null;
  }
};

// When a tab kept its work: read without the rest, which may be long.
const savedAt = (name) => Number(/^\{"saved":(\d+)/.exec(localStorage.getItem(WORK + name))?.[1] ?? 0);

// The names of all tabs that left work, the newest first.
const all = () =>
  Object.keys(localStorage)
    .filter((key) => key.startsWith(WORK))
    .map((key) => key.slice(WORK.length))
    .sort((a, b) => savedAt(b) - savedAt(a));

// The work that this tab goes on with, or null.
export async function lastWork() {
  try {
    const known = sessionStorage.getItem(TAB);
    const work = read(known ?? all()[0]);
    tab = known && (await isAlone(known)) ? known : fresh();
    if (tab !== known) await isAlone(tab);
    sessionStorage.setItem(TAB, tab);
    return work;
  } catch {
    return null; // no storage: the page begins anew each time
  }
}

export function keepWork(essence) {
  if (tab === null) return;
  const text = JSON.stringify({ saved: Date.now(), ...essence });
  const others = all().filter((name) => name !== tab);
  for (const name of others.slice(MOST - 1)) localStorage.removeItem(WORK + name);
  for (;;) {
    try {
      return localStorage.setItem(WORK + tab, text);
    } catch {
      // Full: the oldest make room. Without any, an older state would come back as if it were the last.
      const oldest = others.pop();
      localStorage.removeItem(WORK + (oldest ?? tab));
      if (oldest === undefined) return undefined;
    }
  }
}

export function forgetWork() {
  if (tab !== null) localStorage.removeItem(WORK + tab);
}
