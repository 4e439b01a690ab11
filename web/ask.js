// A question before something that cannot be undone.

import { element } from "./dom.js";

// Whether the person says `yes`; Escape and the other button say no.
export function ask({ title, detail = "", yes, no = "Cancel" }) {
  const dialog = element(
    "dialog", { class: "dialog", "aria-labelledby": "question" },
    element("form", { method: "dialog" },
      element("h2", { id: "question" }, title), detail ? element("p", { class: "dim" }, detail) : null,
      element("div", { class: "row end" },
        element("button", { class: "button", value: "no" }, no), element("button", { class: "button primary", value: "yes" }, yes))),
  );
  document.body.append(dialog);
  dialog.showModal();
  return new Promise((resolve) => {
    dialog.addEventListener("close", () => {
      dialog.remove();
      resolve(dialog.returnValue === "yes");
    });
  });
}
