// Files that come in: by drop, by the file picker. Meshes become shapes, HDR images the environment, other
// images textures, glTF a scene, JSON what it says it is.

import { fetchAssetScene, upload } from "./api.js";
import { ball, measure, wayOut } from "./bounds.js";
import { axes } from "./camera.js";
import { isUnderNoSky, studio } from "./lighting.js";
import { PLAIN, fresh } from "./materials.js";
import { pointer } from "./patch.js";
import { problemText } from "./problem-text.js";
import { readRecipe } from "./recipe.js";
import { fields, materialModels } from "./schema.js";
import { revived } from "./share.js";
import { pictured } from "./textures.js";
import { inWords } from "./words.js";

const ENDINGS = { gltf: "scene", glb: "scene", obj: "mesh", ply: "mesh", stl: "mesh", hdr: "light", exr: "light", png: "image", jpg: "image", jpeg: "image", webp: "image", json: "json", sunbox: "json" };
const ORDER = ["json", "scene", "mesh", "light", "image"]; // a texture comes after the mesh that it is for

const accepted = (kinds) => Object.keys(ENDINGS).filter((ending) => kinds.includes(ENDINGS[ending])).map((ending) => `.${ending}`).join(",");
export const ACCEPT = accepted(ORDER);
export const ACCEPT_IMAGES = accepted(["image", "light"]);

const sort = (file) => ENDINGS[file.name.split(".").at(-1).toLowerCase()];
const stem = (file) => file.name.replace(/\.[^.]*$/, "").replaceAll(/[^\w-]+/g, "-").slice(0, 40) || "image";

export class Importer {
  // `acts` is the editor; `messages` tells; `picked(x, y)` gives the shape under a point of the page, or null;
  // `reopen(recipe, title)` opens what a picture was made from; `thumbnails` are those of textures.
  constructor({ schema, acts, messages, picked, reopen, thumbnails }) {
    Object.assign(this, { schema: schema.scene, acts, messages, picked, reopen, thumbnails });
    this.takesTextures = schema.scene.properties.textures !== undefined;
  }

  // One after the other; `at` is where they were dropped.
  async take(files, at = null) {
    const known = [...files].sort((a, b) => ORDER.indexOf(sort(a)) - ORDER.indexOf(sort(b)));
    // An image that comes with a mesh is for that, wherever they fell.
    const place = known.some((file) => ["mesh", "scene"].includes(sort(file))) ? null : at;
    for (const file of known) {
      try {
        await this.#take(file, place);
      } catch (problem) {
        this.messages.show("refusal", { title: `${file.name} was not taken.`, detail: problemText(problem) });
      }
      this.messages.hide("upload");
    }
  }

  async #take(file, at) {
    const kind = sort(file);
    if (!kind) throw new Error(`Sunbox reads ${[...new Set(Object.keys(ENDINGS))].join(", ")}.`);
    if (kind === "json") return this.openJson(await file.text(), stem(file));
    const recipe = await readRecipe(file);
    if (recipe) return this.reopen(recipe, stem(file));
    const info = await this.upload(file);
    if (info.kind === "scene") return this.#openScene(info, file);
    if (info.kind === "mesh") return this.#addMesh(info, file);
    if (kind === "light") return this.acts.putEnvironment({ type: "image", asset: info.id });
    const isCertain = at === null || (await this.#aim(at, file));
    this.#paint(this.#colorField(), info, file);
    if (!isCertain) {
      const material = inWords(this.acts.state.chosen.material);
      this.messages.show("import", { title: `${file.name} is on ${material}.`, detail: "The picture was not ready to tell what it fell on, so the selected material took it." });
    }
  }

  // Selects what an image fell on, if it is not the background; false where that can't be told.
  async #aim({ x, y }, file) {
    this.messages.show("upload", { title: `Finding what ${file.name} fell on`, lasting: true });
    try {
      const shape = await this.picked(x, y);
      if (shape !== null) this.acts.select(pointer("shapes", shape));
      return true;
    } catch {
      return false; // no picture yet, or no connection: what was dropped must not be lost with it
    }
  }

  async upload(file) {
    const set = this.messages.show("upload", { title: `Sending ${file.name}`, lasting: true, progress: true });
    return upload(file, set);
  }

  // A scene, a material or a whole page's state, by what it holds.
  openJson(text, name) {
    const document = JSON.parse(text);
    if (document?.scene?.shapes) this.acts.change(revived(document));
    else if (document?.shapes) this.acts.openScene(document, name);
    else if (materialModels(this.schema)[document?.type]) this.acts.putMaterial(document);
    else throw new Error("It holds neither a scene nor a material.");
  }

  async #openScene({ id, exposure, warnings = [] }, file) {
    const document = await fetchAssetScene(id);
    this.acts.openScene(document, stem(file), exposure);
    const taken = exposure === undefined ? [] : [`The view's exposure is ${exposure} stops now, which suits the model's lights.`];
    const action = isUnderNoSky(document) && { label: "Add the studio", does: () => this.#addStudio(exposure) };
    this.#tell(file, [...taken, ...warnings], "good to know.", action);
  }

  async #addStudio(exposure) {
    try {
      this.acts.putEnvironment(await studio(exposure), "studio");
      this.messages.hide("import");
    } catch (problem) {
      this.acts.complain(problem);
    }
  }

  #tell(file, warnings, what, action = null) {
    if (!warnings.length) return;
    const list = warnings.map((each) => (typeof each === "string" ? each : [each.pointer, each.detail].filter(Boolean).join(": ")));
    this.messages.show("import", { title: `${file.name}: ${what}`, list, action });
  }

  // In sight: the camera goes where it fills the picture, and what lies inside of something else is put beside it.
  #addMesh({ id, bounds, warnings = [] }, file) {
    const { state } = this.acts;
    const material = fresh(stem(file), state.scene.materials);
    const materials = { ...state.scene.materials, [material]: PLAIN };
    let shape = { type: "mesh", asset: id, material };
    let { camera } = state.scene;
    if (bounds) {
      measure(id, bounds);
      const out = wayOut(ball(shape), state.scene.shapes, axes(this.acts.camera).right);
      if (out) shape = { ...shape, transform: { translate: out.map((x) => Number(x.toPrecision(4))) } };
      if (ball(shape).radius > 0) camera = { ...camera, ...this.acts.framed(ball(shape)) };
    }
    this.acts.add("shapes", shape, { materials, camera });
    this.#tell(file, warnings, "taken as it is.");
  }

  #colorField() {
    const { type } = this.acts.material;
    const field = fields(this.schema, materialModels(this.schema)[type]).find(({ widget, takesTexture }) => widget === "color" && takesTexture);
    return field && `${this.acts.materialPlace}/${field.name}`;
  }

  // An image for a parameter.
  async texture(place, file) {
    try {
      await this.#paint(place, await this.upload(file), file);
    } catch (problem) {
      this.messages.show("refusal", { title: `${file.name} was not taken.`, detail: problemText(problem) });
    }
    this.messages.hide("upload");
  }

  #paint(place, { id, kind }, file) {
    if (!this.takesTextures || !place) throw new Error("Nothing here takes an image.");
    if (kind !== "image") throw new Error("An image is needed here: PNG, JPEG, WebP, EXR or HDR.");
    this.thumbnails.keep(id, file);
    this.acts.change(pictured(this.acts.state, place, id, stem(file)));
  }
}

// Watches the page for files: `tell(text or null)` shows what a drop would do.
export function watchDrops(page, { take, tell }) {
  let depth = 0;
  const isFiles = (event) => event.dataTransfer?.types.includes("Files");
  page.addEventListener("dragenter", (event) => {
    if (!isFiles(event)) return;
    depth += 1;
    tell("Scenes (GLB, JSON), meshes (OBJ, PLY, STL), light (HDR, EXR), images (PNG, JPEG)");
  });
  page.addEventListener("dragleave", (event) => {
    if (isFiles(event) && (depth -= 1) <= 0) tell(null);
  });
  page.addEventListener("dragover", (event) => { if (isFiles(event)) event.preventDefault(); });
  page.addEventListener("drop", (event) => {
    depth = 0;
    tell(null);
    if (event.defaultPrevented || !event.dataTransfer?.files.length) return;
    event.preventDefault();
    take([...event.dataTransfer.files], { x: event.clientX, y: event.clientY });
  });
}
