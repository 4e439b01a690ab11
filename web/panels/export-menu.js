// What leaves the page as a file or a command: the items of the menu "Export".

import { documentFile, pictureFile } from "../document/file-name.js";
import { element } from "../lib/dom.js";
import { jsonBlob, saveAs } from "../lib/files.js";

// Formats of scenes: how people call them, for whom they are, and the server's name.
const SCENES = [
  ["glTF", "for other programs", "glb"],
  ["MaterialX", "materials alone", "mtlx"],
];

export class ExportMenu {
  // `acts`: title() of the scene, scene(), material(), png(bits) and exr() -> {blob, header}, isWanted() resolves to
  // whether the PNG is to be saved, link() to the page as it is, made() in words of what, command() and program() that
  // make this picture, formats() that the server writes scenes in, titles() of fields, messages, complain(error),
  // announce(text).
  constructor(root, acts) {
    this.root = root;
    this.acts = acts;
    const picture = (make, ending) => () =>
      this.#try(async () => {
        if (ending === "png" && !(await acts.isWanted())) return;
        const { blob, header } = await make();
        saveAs(blob, pictureFile(acts.title(), header, ending));
      });
    this.png = picture(() => acts.png(8), "png");
    const json = (kind) => () => saveAs(jsonBlob(acts[kind]()), documentFile(acts.title(), kind, "json"));
    this.pictures = [
      ["PNG", "8 bit, as it is on screen", "download", this.png],
      ["PNG, 16 bit", "", "download-16", picture(() => acts.png(16), "png")],
      ["EXR", "all layers, linear", "download-exr", picture(() => acts.exr(), "exr")],
      ["Share picture", "with name, material and link", "share-picture", () => this.#try(() => this.#share())],
    ];
    this.documents = [
      ["JSON", "the scene", "download-scene", json("scene")],
      ["JSON, material", "", "download-material", json("material")],
    ];
    this.programs = [
      ["curl", "copies a command that makes this picture", "copy-curl", () => this.#hand("command")],
      ["Python", "copies a program that does", "copy-python", () => this.#hand("program")],
    ];
    this.refresh();
  }

  // Call before it is shown.
  refresh() {
    const known = this.acts.formats();
    const files = SCENES.filter(([, , format]) => known.includes(format)).map(([title, note, format]) => [
      title,
      note,
      `download-${format}`,
      () => this.#file(format),
    ]);
    this.root.replaceChildren(
      ...[...this.pictures, null, ...files, ...this.documents, null, ...this.programs].map((item) => {
        if (!item) return element("hr");
        const [title, note, id, does] = item;
        return element(
          "button",
          { type: "button", role: "menuitem", id, "aria-label": title, title: note, onclick: does },
          title,
          element("span", { class: "dim" }, note),
        );
      }),
    );
  }

  async #try(work) {
    try {
      await work();
    } catch (error) {
      this.acts.complain(error);
    }
  }

  // The picture with a caption, to the device's other programs or as a file.
  async #share() {
    if (!(await this.acts.isWanted())) return;
    const { captioned, offered } = await import("../picture/shared-picture.js");
    const [{ blob, header }, url] = [await this.acts.png(8), await this.acts.link()];
    const title = this.acts.title();
    const { host, pathname } = new URL(url);
    const picture = await captioned(blob, { title, note: this.acts.made(), link: `${host}${pathname}` });
    const name = pictureFile(title, header, "png");
    const file = new File([picture], name, { type: "image/png" });
    if (await offered(file, { title, url })) return;
    saveAs(picture, name);
    await handOut(url, "The picture is saved. The link", this.acts);
  }

  // A scene for another program, which may lose some of it.
  #file(format) {
    return this.#try(async () => (await import("./file-export.js")).exportFile(format, this.acts));
  }

  #hand(what) {
    return this.#try(async () => handOut(await this.acts[what](), `The ${what}`, this.acts));
  }
}

// Puts text where it can be pasted from: into the clipboard, else on the page to be copied by hand.
export async function handOut(text, what, { announce, show }) {
  const isCopied = await navigator.clipboard?.writeText(text).then(
    () => true,
    () => false,
  );
  const field = element(
    "textarea",
    { class: "command", readonly: true, spellcheck: "false", "aria-label": what },
    text,
  );
  show(isCopied ? `${what} is copied.` : `${what}, to be copied by hand.`, field);
  if (isCopied) announce(`${what} is copied.`);
  else field.select();
}
