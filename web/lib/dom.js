// A few lines that spare the rest of the editor from long-winded DOM calls.

let counter = 0;
export const freshId = (stem) => `${stem}-${++counter}`;
// Where a page holds several copies of this module, each begins elsewhere.
export const beginIds = (at) => {
  counter = at;
};

// An element with attributes (`class`, `aria-label`, ...; true and false switch one on and off),
// listeners (`onclick`, ...) and children.
export function element(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (typeof value === "boolean") node.toggleAttribute(name, value);
    else if (value !== undefined) node.setAttribute(name, value);
  }
  node.append(...children.filter((child) => child !== null && child !== undefined));
  return node;
}

// Takes the source from each image whose picture does not come: style.css shows something plain in its place then, never
// the browser's broken sign.
export function watchImages(root) {
  root.addEventListener(
    "error",
    ({ target }) => {
      if (target.tagName === "IMG") target.removeAttribute("src");
    },
    true, // the event does not bubble
  );
}

// True while the user writes into a field: its text must not be replaced under the hand.
export const isBeingEdited = (input) => document.activeElement === input && input.dataset.dirty === "yes";
