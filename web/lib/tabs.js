// Tabs as the ARIA practices describe them: arrows move, one of them is in the tab order.

export function watchTabs(list, chosen, choose) {
  const tabs = [...list.querySelectorAll("[role=tab]")];
  const show = (id) => {
    for (const tab of tabs) {
      const isIt = tab.id === `tab-${id}`;
      tab.setAttribute("aria-selected", String(isIt));
      tab.tabIndex = isIt ? 0 : -1;
      document.getElementById(tab.getAttribute("aria-controls")).hidden = !isIt;
    }
  };
  for (const tab of tabs) tab.addEventListener("click", () => choose(tab.id.slice(4)));
  list.addEventListener("keydown", ({ key }) => {
    const at = tabs.indexOf(document.activeElement);
    const to = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: tabs.length - 1 }[key];
    if (to === undefined || at < 0) return;
    const next = tabs[(to + tabs.length) % tabs.length];
    next.focus();
    next.click();
  });
  show(chosen);
  return show;
}

// A row of buttons of which one is chosen: arrows move among them.
export function watchChoice(root, selector, pick) {
  root.addEventListener("click", ({ target }) => {
    const button = target.closest(selector);
    if (button) pick(button);
  });
  root.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    const all = [...root.querySelectorAll(selector)];
    const at = all.indexOf(document.activeElement);
    if (!step || at < 0) return;
    event.preventDefault();
    const next = all[(at + step + all.length) % all.length];
    next.focus();
    pick(next);
  });
  return (isChosen) => {
    for (const button of root.querySelectorAll(selector)) {
      const on = isChosen(button);
      button.setAttribute("aria-checked", String(on));
      button.tabIndex = on ? 0 : -1;
    }
  };
}
