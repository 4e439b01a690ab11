// What can be chosen for a side of a comparison, as the options of a <select>.

import { listRenders } from "../server/api.js";
import { recallAll } from "../lib/browser-storage.js";
import { element } from "../lib/dom.js";
import { equal } from "../lib/patch.js";
import { PHOTO, RENDER, SNAPSHOT } from "../document/variants.js";
import { hasPicture } from "../renders/renders.js";
import { titleOf } from "../renders/words.js";
import { snapshotTitle } from "./sides.js";

const MOST = 50; // renders that are listed, the newest

const VARIANTS = [
  ["a", "Variant A"],
  ["b", "Variant B"],
];

const group = ([label, entries]) =>
  element("optgroup", { label }, ...entries.map(([value, title]) => element("option", { value }, title)));

export class Choices {
  #snapshots = [];
  #renders = [];
  #groups = []; // as the selects have them
  #latest = null;

  // `selects`: {left, right}.
  constructor(selects) {
    this.selects = selects;
  }

  // Asks the browser for its snapshots and the server for its renders.
  async refresh() {
    const snapshots = await recallAll(SNAPSHOT);
    this.#snapshots = snapshots.map(({ name }) => [name, snapshotTitle(name)]).reverse();
    const { renders } = await listRenders({ limit: MOST }).catch(() => ({ renders: [] })); // then the rest has to do
    this.#renders = renders.filter(hasPicture).map((each) => [RENDER + each.id, titleOf(each)]);
    if (this.#latest) this.show(...this.#latest);
  }

  // `names`: {left, right} as they are chosen; `photo`: what the photograph is called.
  show(names, photo) {
    this.#latest = [names, photo];
    // What was deleted, or is older than what is listed, is chosen all the same.
    const withChosen = (known, start, title) => {
      const missing = Object.values(names).filter((name) => name.startsWith(start));
      const others = missing.filter((name) => !known.some(([value]) => value === name));
      return [...known, ...others.map((name) => [name, title(name)])];
    };
    const groups = [
      ["Variants", VARIANTS],
      ["Snapshots", withChosen(this.#snapshots, SNAPSHOT, snapshotTitle)],
      ["Renders", withChosen(this.#renders, RENDER, () => "Another render")],
      ["From a file", [[PHOTO, photo]]],
    ].filter(([, entries]) => entries.length);
    if (!equal(groups, this.#groups))
      for (const select of Object.values(this.selects)) select.replaceChildren(...groups.map(group));
    this.#groups = groups;
    for (const [side, select] of Object.entries(this.selects)) select.value = names[side];
  }
}
