// A form made from a model of the server's schema: a row for each field, with its range, unit, hint,
// default and a button that goes back to it.

import { linear } from "../lib/color.js";
import { isLength } from "./amounts.js";
import { control } from "./controls.js";
import { element, freshId } from "../lib/dom.js";
import { folds } from "./folds.js";
import { acceptFiles } from "../lib/files.js";
import { equal, isObject } from "../lib/patch.js";
import { followed } from "../server/schema.js";
import { scrubBy } from "../lib/scrub.js";
import { endsOf } from "../lib/span.js";
import { describe } from "../lib/tooltip.js";
import { unitText } from "../lib/format-text.js";

const isSame = ({ widget }, a, b) =>
  ["color", "amounts"].includes(widget) && a !== undefined && b !== undefined
    ? equal(linear(a), linear(b))
    : equal(a, b);

const isTexture = (value) => isObject(value) && value.texture !== undefined;

function row(field, { change, commit, forgive, takeFile, pickFile, slot, beneath }) {
  const id = freshId(field.name);
  const trouble = element("p", { class: "trouble", id: `${id}-trouble`, hidden: true });
  const mark = (text) => {
    trouble.hidden = !text;
    trouble.textContent = text ?? "";
    for (const input of node.querySelectorAll("input, select")) {
      if (under?.element.contains(input)) continue; // has words of its own
      if (text) input.setAttribute("aria-invalid", "true");
      else input.removeAttribute("aria-invalid");
    }
  };
  let latest;
  let isChanged = false;
  const widget = control(field, id, {
    input: (value) => {
      mark(null);
      change(field.name, value);
    },
    commit,
    pick: () => pickFile?.(field),
    refuse: mark,
    restore: () => {
      mark(null);
      widget.show(latest);
      forgive();
    },
  });
  const reset = element("button", {
    type: "button",
    class: "reset",
    "aria-label": `Reset ${field.title}`,
    onclick: () => {
      mark(null);
      change(field.name, undefined);
      commit();
    },
  });
  const label = element("label", { for: id }, field.title);
  if (field.unit && !isLength(field)) {
    const unit = unitText(field.unit);
    label.append(unit.length < 3 ? "\u00a0" : " ", element("span", { class: "unit", "aria-hidden": "true" }, unit)); // said with the value
  }
  if (widget.drag) scrubBy(label, widget.drag);
  const hint = field.hint ? element("p", { class: "unseen", id: `${id}-hint` }, field.hint) : null;
  const image = field.takesTexture
    ? slot?.(field, () => {
        change(field.name, undefined);
        commit();
      })
    : undefined;
  const under = image && beneath?.(field);
  const parts = [label, widget.element, image?.chip, image?.button, reset, under?.element, hint, trouble].filter(
    Boolean,
  );
  const node = element("div", { class: image ? "field pictured" : "field", "data-field": field.name }, ...parts);
  if (image && takeFile) acceptFiles(node, (file) => takeFile(field.name, file));
  for (const input of node.querySelectorAll("input, select")) {
    input.setAttribute("aria-describedby", `${hint ? hint.id : ""} ${trouble.id}`.trim());
  }
  if (hint) describe(node, label, field.hint);
  return {
    element: node,
    mark,
    isChanged: () => isChanged,
    // `effective`: what holds where neither the document nor the schema has a value; `ends`: of a slider whose range
    // depends on another field.
    show(value, initial = field.initial, effective = undefined, ends = undefined) {
      latest = value ?? initial;
      const textured = isTexture(latest);
      if (image) {
        widget.element.hidden = textured || field.widget === "texture";
        image.show(latest);
        under?.show(latest);
      }
      if (trouble.hidden && !textured) widget.show(latest, effective, ends); // else what was refused stays in sight
      isChanged = value !== undefined && !isSame(field, value, initial);
      reset.hidden = textured || field.required || !isChanged;
    },
  };
}

// Calls `change(name, value)` with each new value (undefined: the default again), `commit()` when the
// hand comes to rest, `forgive()` when something refused is taken back by hand, `takeFile(name, file)` when an
// image is dropped onto a field that takes textures, `pickFile(field)` where the person wants another file; `slot(field, remove)` may make the TextureSlot of such a field,
// and `beneath(field)` {element, show} for what it has to say of its image.
export function schemaForm(fields, acts) {
  const rows = new Map(fields.map((field) => [field.name, row(field, acts)]));
  const parts = fields.some(({ group }) => group) ? folds(rows, fields) : null;
  return {
    element: parts?.element ?? element("div", { class: "form" }, ...[...rows.values()].map((each) => each.element)),
    filter: (text) => parts?.filter(text),
    // `initials` stand in for the schema's defaults where these depend on something else.
    show(values, initials = {}) {
      for (const [name, each] of rows) {
        const field = fields.find((one) => one.name === name);
        const valueOf = (leader) => values[leader] ?? fields.find((one) => one.name === leader)?.initial;
        const ends = field.ranges && endsOf(field, valueOf(field.ranges.field));
        each.show(values[name], initials[name], followed(field, valueOf(field.follows?.field)), ends);
        each.element.classList.toggle(
          "unused",
          Boolean(field.used) && !field.used.values.includes(valueOf(field.used.field)),
        );
        each.element.hidden = (values[field.unless] ?? null) !== null;
      }
      parts?.show(values);
    },
    // Says at a field what is wrong with it; false where this form has no such field.
    mark(name, text) {
      rows.get(name)?.mark(text);
      if (text) parts?.reveal(name);
      return rows.has(name);
    },
    forgive() {
      for (const each of rows.values()) each.mark(null);
    },
  };
}
