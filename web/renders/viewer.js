// A render in a window of its own: its picture as large as it fits, and what it was made with.

import { renderImage } from "../server/api.js";
import { element, freshId } from "../lib/dom.js";
import { furtherActs } from "./list.js";
import { hasPicture } from "./renders.js";
import { factsOf, stateOf, titleOf } from "./words.js";

// `acts` as RenderList has them, with view(render) beside.
export function openRender(render, acts) {
  const id = freshId("render-title");
  const title = titleOf(render);
  const left = new AbortController();
  const image = element("img", { alt: `The picture of ${title}`, hidden: true });
  const note = element(
    "p",
    { class: "note", role: "status" },
    hasPicture(render) ? "Reading the picture…" : "There is no picture yet.",
  );
  const act = (label, does, disabled = false) =>
    element("button", { type: "button", class: "button small", disabled, onclick: does }, label);
  const leave = (does) => () => {
    dialog.close();
    does();
  };
  const isEmpty = !hasPicture(render);
  const dialog = element(
    "dialog",
    {
      class: "dialog render-view",
      "aria-labelledby": id,
      onclose: () => {
        left.abort();
        dialog.remove();
        if (image.src) URL.revokeObjectURL(image.src);
      },
      onclick: ({ target }) => {
        if (target === dialog) dialog.close(); // beside it
      },
    },
    element(
      "div",
      { class: "render-sheet" },
      element(
        "header",
        {},
        element("h2", { id }, title),
        element("button", { type: "button", class: "button small", onclick: () => dialog.close() }, "Close"),
      ),
      element("div", { class: "render-picture" }, image, note),
      element("p", { class: "note" }, [stateOf(render, acts.left(render)), ...factsOf(render)].join(" · ")),
      ...(render.warnings.length
        ? [element("ul", { class: "note" }, ...render.warnings.map((each) => element("li", {}, each)))]
        : []),
      element(
        "div",
        { class: "row" },
        act("Download PNG", () => acts.save(render, "png"), isEmpty),
        act("Download EXR", () => acts.save(render, "exr"), isEmpty),
        ...furtherActs(acts, render).map(({ label, does, disabled, leaves }) =>
          act(label, leaves ? leave(does) : does, disabled),
        ),
      ),
    ),
  );
  document.body.append(dialog);
  dialog.showModal();
  if (isEmpty) return;
  renderImage(render.id, { format: "webp", ...acts.view(render) }, { signal: left.signal })
    .then((blob) => {
      image.src = URL.createObjectURL(blob);
      image.hidden = false;
      note.hidden = true;
    })
    .catch((problem) => {
      note.textContent = problem.message;
    });
}
