// What the files of this page are called.

const stem = (title) =>
  title
    .normalize("NFC")
    .replaceAll(/[^\p{L}\p{N}]+/gu, "-")
    .replaceAll(/^-+|-+$/g, "") || "scene";

// A picture's file: the scene's name, the size, the samples.
export const pictureFile = (title, { width, height, samples }, ending) =>
  `${stem(title)}-${width}x${height}-${samples}.${ending}`;

// A document's file: the scene's name, and what of it.
export const documentFile = (title, what, ending) => `${stem(title)}-${what}.${ending}`;

// A whole scene's.
export const sceneFile = (title, ending) => `${stem(title)}.${ending}`;
