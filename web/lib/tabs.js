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

// A row of buttons of which one is chosen: arrows move among them. `state` is the attribute that says which.
export function watchChoice(root, selector, pick, state = "aria-checked") {
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
      button.setAttribute(state, String(on));
      button.tabIndex = on ? 0 : -1;
    }
  };
}

// Buttons that are one stop of the Tab key together: arrows move among those that can be pressed.
export function watchToolbar(root, selector = "button") {
  const all = () => [...root.querySelectorAll(selector)].filter((each) => !each.disabled && each.checkVisibility());
  const stop = (at) => {
    for (const each of root.querySelectorAll(selector)) each.tabIndex = each === at ? 0 : -1;
  };
  root.addEventListener("focusin", ({ target }) => stop(target.closest(selector)));
  root.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    const buttons = all();
    const at = buttons.indexOf(document.activeElement);
    if (!step || at < 0) return;
    event.preventDefault();
    buttons[(at + step + buttons.length) % buttons.length].focus();
  });
  stop(root.querySelector(selector));
}
