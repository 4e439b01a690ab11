// The rows of a material's form in folds, by the parts that the schema names. The first stands open; another one opens
// by hand, or where the document says something of it, and its head tells what has been changed.

import { hex, linear } from "../lib/color.js";
import { element } from "../lib/dom.js";
import { compact, inWords } from "../lib/format-text.js";
import { isObject } from "../lib/patch.js";
import { amountWords } from "./amounts.js";

const ORDER = ["Base", "Specular", "Coat", "Sheen", "Transmission", "Subsurface", "Film", "Emission", "Geometry"];
const MOST_WORDS = 3; // values that a head tells
const byHand = new Map(); // whether a fold was opened or shut by hand, by its name: the next material finds it so

const place = (group) => (ORDER.indexOf(group) + 1 || ORDER.length + 1) - 1;

// A value as the head of its fold has it: words and, of a colour, a swatch before them.
function words(field, value, group) {
  const { title, widget } = field;
  const short = title.replace(new RegExp(`^(${group}|clearcoat) `, "i"), "").toLowerCase();
  if (value?.texture !== undefined) return [`${short} ${value.texture}`];
  if (widget === "color") return [swatch(value), short];
  if (isObject(value)) return [short];
  if (["amount", "amounts"].includes(widget)) return [`${short} ${amountWords(field, value)}`];
  if (typeof value === "boolean") return [value ? short : `no ${short}`];
  return [`${short} ${typeof value === "string" ? inWords(value).toLowerCase() : compact(value)}`];
}

function swatch(value) {
  const now = linear(value);
  const most = Math.max(1, ...now);
  const dot = element("i", { class: "swatch" });
  dot.style.setProperty("background", hex(now.map((x) => x / most)));
  return dot;
}

// `rows`: Map of a field's name to {element, isChanged}; `fields` those of the schema.
export function folds(rows, fields) {
  const groups = [...new Set(fields.map(({ group }) => group))].sort((a, b) => place(a) - place(b));
  let isMade = false;
  let query = "";
  const parts = groups.map((group, i) => {
    const own = fields.filter((field) => field.group === group);
    const elements = own.map(({ name }) => rows.get(name).element);
    const told = element("span", { class: "told" });
    const body = element("div", { class: "form" }, ...elements);
    if (i === 0)
      return {
        group,
        own,
        told,
        node: element(
          "section",
          { class: "fold", role: "group", "aria-label": group },
          element("h3", {}, group),
          body,
        ),
      };
    const head = element("summary", {}, element("h3", {}, group), told);
    const node = element("details", { class: "fold", "aria-label": group }, head, body);
    head.addEventListener("click", () => {
      if (!query) byHand.set(group, !node.open);
    });
    return { group, own, told, node };
  });

  const sift = () => {
    for (const { group, own, node } of parts) {
      const isFound = ({ title, hint, name }) => `${group} ${title} ${name} ${hint}`.toLowerCase().includes(query);
      const found = own.filter(isFound);
      for (const { name } of own)
        rows.get(name).element.classList.toggle("sifted", Boolean(query) && !found.some((f) => f.name === name));
      node.classList.toggle("sifted", Boolean(query) && !found.length);
      if (node.tagName !== "DETAILS") continue;
      if (query) node.open = found.length > 0;
      else node.open = byHand.get(group) ?? node.classList.contains("changed");
    }
  };

  return {
    element: element("div", { class: "folds" }, ...parts.map(({ node }) => node)),
    show(values) {
      for (const { group, own, told, node } of parts) {
        const changed = own.filter(({ name }) => rows.get(name).isChanged());
        const first = changed.slice(0, MOST_WORDS);
        const now = JSON.stringify([changed.length, first.map(({ name }) => [name, values[name]])]);
        if (told.dataset.now !== now) {
          const parts = first.flatMap((field, i) => [
            ...(i ? [", "] : []),
            ...words(field, values[field.name], group),
          ]);
          told.replaceChildren(...parts, ...(changed.length > MOST_WORDS ? [", …"] : []));
          told.dataset.now = now;
        }
        node.classList.toggle("changed", changed.length > 0);
      }
      if (!isMade) sift();
      isMade = true;
    },
    // Opens the fold of a field.
    reveal(name) {
      const node = rows.get(name)?.element.closest("details.fold");
      if (node) node.open = true;
    },
    // Shows only what has these letters in its words; all for "".
    filter(text) {
      query = text.trim().toLowerCase();
      sift();
    },
  };
}
