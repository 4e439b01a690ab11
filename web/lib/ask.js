// Questions in a dialog of their own. Escape and the button for it answer null.

import { element, freshId } from "./dom.js";

// Resolves to what `answer(value)` makes of the button that was pressed: one of `choices` [{label, value}], the first
// of which is what Enter does, or one in `body`. `check()` may keep the dialog open.
export function question({
  title,
  detail = "",
  body = [],
  choices = [],
  no = "Cancel",
  answer = (value) => value,
  check = () => true,
}) {
  return new Promise((resolve) => {
    const id = freshId("question");
    let given = null;
    const buttons = choices.map(({ label, value }, i) =>
      element("button", { class: i ? "button" : "button primary", value }, label),
    );
    const cancel = element("button", { type: "button", class: "button", onclick: () => dialog.close() }, no);
    const form = element(
      "form",
      {
        method: "dialog",
        onsubmit: (event) => {
          if (!check()) return event.preventDefault();
          given = answer(event.submitter.value);
        },
      },
      element("h2", { id }, title),
      detail ? element("p", { class: "dim" }, detail) : null,
      ...body,
      element("div", { class: "row end" }, cancel, ...buttons),
    );
    const dialog = element(
      "dialog",
      {
        class: "dialog",
        "aria-labelledby": id,
        onclose: () => {
          dialog.remove();
          resolve(given);
        },
      },
      form,
    );
    document.body.append(dialog);
    dialog.showModal();
  });
}

// Whether the person says `yes`.
export const ask = async ({ yes, ...asked }) =>
  (await question({ ...asked, choices: [{ label: yes, value: "yes" }] })) !== null;

// A name; `problem(name)` says what is wrong with one, or null.
export function askName({ title, label, value, action, problem }) {
  const id = freshId("name");
  const entry = element("input", { class: "entry", id, value, autocomplete: "off", spellcheck: "false" });
  const trouble = element("p", { class: "trouble", id: `${id}-trouble`, role: "alert", hidden: true });
  entry.setAttribute("aria-describedby", trouble.id);
  const asked = question({
    title,
    body: [element("label", { for: id }, label), entry, trouble],
    choices: [{ label: action, value: "given" }],
    answer: () => entry.value.trim(),
    check() {
      const wrong = problem(entry.value.trim());
      trouble.hidden = !wrong;
      trouble.textContent = wrong ?? "";
      entry.setAttribute("aria-invalid", String(Boolean(wrong)));
      return !wrong;
    },
  });
  entry.select();
  return asked;
}

// One of several things in a list: [{value, title}].
export function askWhich({ title, detail, label, options, action }) {
  const id = freshId("which");
  const select = element(
    "select",
    { id },
    ...options.map((each) => element("option", { value: each.value }, each.title)),
  );
  return question({
    title,
    detail,
    body: [element("label", { for: id }, label), select],
    choices: [{ label: action, value: "given" }],
    answer: () => select.value,
  });
}
