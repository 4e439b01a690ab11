// The place for an image beside a parameter: a button that offers the scene's textures, a file or one that is computed, and a
// chip with the texture's picture while there is one.

import { element } from "../lib/dom.js";
import { accepted, browse } from "../lib/files.js";
import { isObject } from "../lib/patch.js";
import { made, used, users } from "../document/textures.js";

const ICON =
  "M2 3h12v10H2zm1.4 1.4v5.2l2.7-2.9 2.6 2.8 1.6-1.5 2.3 2.2V4.4zm7.3.9a1.1 1.1 0 1 1 0 2.2 1.1 1.1 0 0 1 0-2.2";
const NAMED = "texture:";
// What can be computed, with what it looks like.
const MADE = {
  checker: ["two values by turns", { a: 0.8, b: 0.2 }],
  noise: ["clouds, grain, creases", {}],
  ramp: ["colours along a line", { stops: [0.05, 0.8].map((color, position) => ({ position, color })) }],
};

function icon() {
  const [svg, path] = ["svg", "path"].map((tag) => document.createElementNS("http://www.w3.org/2000/svg", tag));
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("aria-hidden", "true");
  path.setAttribute("fill-rule", "evenodd");
  path.setAttribute("d", ICON);
  svg.append(path);
  return svg;
}

const isTexture = (value) => isObject(value) && value.texture !== undefined;

// What the slots of the parameters at each place do.
export const textureActs =
  ({ editor, importer, thumbnails }) =>
  (place, field) => ({
    scene: () => editor.state.scene,
    paint: (canvas, texture) => thumbnails.paint(canvas, texture, editor.state.scene.textures),
    useFile: (file) => importer.texture(place, file),
    useTexture: (name) => editor.change(used(editor.state, place, name)),
    make: (type) => editor.change(made(editor.state, place, field, type)),
  });

// `acts` as textureActs makes them for this parameter, and `remove()`.
export class TextureSlot {
  constructor(field, acts) {
    Object.assign(this, { field, acts });
    const open = () => this.#choose();
    const isOnly = field.widget === "texture"; // nothing but a texture can stand here
    this.button = isOnly
      ? element(
          "button",
          {
            type: "button",
            class: "button small choose",
            "aria-label": `Choose an image for ${field.title}`,
            onclick: open,
          },
          icon(),
          "Choose an image…",
        )
      : element(
          "button",
          { type: "button", class: "image", "aria-label": `Image for ${field.title}`, title: "Image", onclick: open },
          icon(),
        );
    this.canvas = element("canvas", { class: "thumb", "aria-hidden": "true" });
    this.name = element("span", { class: "name" });
    const remove = element(
      "button",
      {
        type: "button",
        class: "forget",
        "aria-label": `Remove the image from ${field.title}`,
        onclick: () => {
          acts.remove();
          this.button.focus();
        },
      },
      "×",
    );
    this.change = element(
      "button",
      { type: "button", class: "open", title: "Another image", onclick: open },
      this.canvas,
      this.name,
    );
    this.chip = element("div", { class: "texture", hidden: true }, this.change, remove);
  }

  // A parameter's value.
  show(value) {
    const isShown = isTexture(value);
    this.chip.hidden = !isShown;
    this.button.hidden = isShown;
    if (!isShown) return;
    this.name.textContent = value.texture;
    const texture = this.acts.scene().textures?.[value.texture];
    if (texture) this.acts.paint(this.canvas, texture);
  }

  #tile(value, title, note, picture) {
    return element(
      "button",
      { class: "tile", value },
      picture,
      element("span", {}, title),
      element("span", { class: "dim" }, note),
    );
  }

  async #choose() {
    const { question } = await import("../lib/ask.js");
    const { acts, field } = this;
    const scene = acts.scene();
    const textures = Object.entries(scene.textures ?? {}).map(([name, texture]) => {
      const canvas = element("canvas", { class: "thumb", "aria-hidden": "true" });
      acts.paint(canvas, texture);
      const count = users(scene, name);
      return this.#tile(
        NAMED + name,
        name,
        count ? `used ${count === 1 ? "once" : `${count} times`}` : "not used",
        canvas,
      );
    });
    const computed = Object.entries(MADE).map(([type, [note, looks]]) => {
      const canvas = element("canvas", { class: "thumb", "aria-hidden": "true" });
      acts.paint(canvas, { type, ...looks });
      return this.#tile(type, `New ${type}`, note, canvas);
    });
    const chosen = await question({
      title: `Image for ${field.title}`,
      body: [
        element(
          "div",
          { class: "tiles" },
          this.#tile(
            "browse",
            "Browse…",
            "PNG, JPEG, WebP, EXR, HDR",
            element("span", { class: "thumb sign" }, icon()),
          ),
          ...(field.widget === "texture" ? [] : computed),
          ...textures,
        ),
      ],
    });
    if (chosen === "browse") {
      const [file] = await browse(accepted(["image", "light"]));
      if (file) await acts.useFile(file);
    } else if (Object.hasOwn(MADE, chosen ?? "")) acts.make(chosen);
    else if (chosen !== null) acts.useTexture(chosen.slice(NAMED.length));
    // The button that asked is hidden now, if there is a texture: the keyboard goes on from the chip.
    if (document.activeElement === document.body) this.change.focus();
  }
}
