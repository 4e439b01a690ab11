// What opens under a button: menus whose items arrows move among, and small panels. The browser closes them with
// Escape or a click elsewhere.

const GAP = 6; // CSS pixels between button and menu
const STEPS = { ArrowDown: 1, ArrowUp: -1 };

// `button` names `menu`, an element with `popover`, as its popovertarget. `opened()` is called before it shows.
export function watchMenu(button, menu, { opened = () => {} } = {}) {
  button.setAttribute("aria-expanded", "false");
  menu.addEventListener("beforetoggle", ({ newState }) => {
    if (newState === "open") opened();
  });
  menu.addEventListener("toggle", ({ newState }) => {
    const isOpen = newState === "open";
    button.setAttribute("aria-expanded", String(isOpen));
    if (!isOpen) return;
    place(button, menu);
    if (menu.getAttribute("role") === "menu") items(menu)[0]?.focus();
  });
  if (menu.getAttribute("role") !== "menu") return;
  menu.addEventListener("click", ({ target }) => {
    if (target.closest("[role=menuitem]")) menu.hidePopover();
  });
  menu.addEventListener("keydown", (event) => {
    const all = items(menu);
    const at = all.indexOf(document.activeElement);
    const to = { Home: 0, End: all.length - 1 }[event.key] ?? (STEPS[event.key] ? at + STEPS[event.key] : null);
    if (event.key === "Tab") menu.hidePopover();
    if (to === null) return;
    event.preventDefault();
    event.stopPropagation();
    all[(to + all.length) % all.length].focus();
  });
}

const items = (menu) => [...menu.querySelectorAll("[role=menuitem]:not([disabled], [hidden])")];

// Under its button, or over it where there is more room, and inside of the window.
function place(button, menu) {
  const from = button.getBoundingClientRect();
  const { offsetWidth: width, offsetHeight: height } = menu;
  const left = Math.max(GAP, Math.min(from.left, innerWidth - width - GAP));
  const isBelow = from.bottom + GAP + height <= innerHeight || from.top < innerHeight - from.bottom;
  menu.style.setProperty("left", `${left}px`);
  menu.style.setProperty("top", `${isBelow ? from.bottom + GAP : Math.max(GAP, from.top - GAP - height)}px`);
}
