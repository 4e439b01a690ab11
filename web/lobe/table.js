// The values of a plot as a table, for eyes that want numbers and for screen readers.

import { element } from "../lib/dom.js";

const DIGITS = 4;

export class Table {
  #made = null;

  constructor() {
    this.body = element("div", {
      class: "lobe-table",
      tabindex: "0",
      role: "region",
      "aria-label": "Values of the plot",
    });
    this.element = element(
      "details",
      { class: "more", ontoggle: () => this.#fill() },
      element("summary", {}, "Values"),
      this.body,
    );
  }

  // Made only while it is open.
  show(view, data) {
    if (this.#made?.view === view && this.#made.data === data) return;
    this.#made = { view, data };
    this.#fill();
  }

  #fill() {
    if (!this.element.open || !this.#made) return;
    const { view, data } = this.#made;
    const { columns, rows, isShown = () => true } = view.table(data);
    const shown = (value) => (value === null ? "–" : String(Number(value.toPrecision(DIGITS))));
    this.body.replaceChildren(
      element(
        "table",
        {},
        element("thead", {}, element("tr", {}, ...columns.map((name) => element("th", { scope: "col" }, name)))),
        element(
          "tbody",
          {},
          ...rows
            .filter(isShown)
            .map(([first, ...rest]) =>
              element(
                "tr",
                {},
                element("th", { scope: "row" }, shown(first)),
                ...rest.map((value) => element("td", {}, shown(value))),
              ),
            ),
        ),
      ),
    );
  }
}
