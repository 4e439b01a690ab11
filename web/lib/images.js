// An image without a picture is none: style.css shows something plain in its place, never the browser's broken sign.

// Takes the source from each image under `root` whose picture does not come.
export function watchImages(root) {
  root.addEventListener(
    "error",
    ({ target }) => {
      if (target.tagName === "IMG") target.removeAttribute("src");
    },
    true, // the event does not bubble
  );
}
