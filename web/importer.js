// Files that come in: by drop, by the file picker. Meshes become shapes, HDR images the environment, other
// images textures, several of one set a material, as MaterialX does, glTF, USD and zipped models a scene, .cube files the
// table that the picture's colours go through, measured reflection a material, JSON what it says.

import { fetchAssetMaterials, fetchAssetScene, fetchPosedScene, upload } from "./server/api.js";
import { question } from "./lib/ask.js";
import { measure, remember } from "./document/bounds.js";
import { accepted, browse, kindOf } from "./lib/files.js";
import { isUnderNoSky, studio } from "./document/lighting.js";
import { unpacked } from "./document/material-set.js";
import { pointer } from "./lib/patch.js";
import { fileValueWords, problemText, warningText } from "./server/problem-text.js";
import { fields, materialModels } from "./server/schema.js";
import { revived } from "./document/share.js";
import { pictured } from "./document/textures.js";
import { count, inWords } from "./lib/format-text.js";

const STAYS = /^\/(cameras|extensions\/KHR_lights_punctual)(\/|$)|\/camera$/; // what adding leaves in its file
const ORDER = ["json", "scene", "mesh", "light", "image", "table", "measurement"]; // a texture comes after the mesh that it is for

const ACCEPT = accepted(ORDER);

const endsIn = (file, ending) => file.name.toLowerCase().endsWith(ending);
const isMaterialX = (file) => endsIn(file, ".mtlx");

// What a file's thing is called: as the file without its ending; a slash would make a group of it.
const titleOf = (file) =>
  file.name
    .replace(/\.[^.]*$/, "")
    .replaceAll("/", "-")
    .slice(0, 80) || "Model";

// A scene whose things have names: those that have none in the file are called as the file is, "duck", "duck 2".
function named(document, file) {
  let count = 0;
  const next = () => ((count += 1) > 1 ? `${titleOf(file)} ${count}` : titleOf(file));
  return { ...document, shapes: document.shapes.map((shape) => (shape.name ? shape : { ...shape, name: next() })) };
}

const stem = (file) =>
  file.name
    .replace(/\.[^.]*$/, "")
    .replaceAll(/[^\w-]+/g, "-")
    .slice(0, 40) || "image";

export class Importer {
  // `acts` is the editor, `adder` sets things beside others; `messages` tells; `controller` knows what is seen;
  // `reopen(recipe, title)` opens what a picture was made from; `thumbnails` are those of textures; `formats()` is what
  // the server says of files.
  constructor({ schema, acts, adder, messages, controller, reopen, thumbnails, formats }) {
    Object.assign(this, { schema: schema.scene, acts, adder, messages, controller, reopen, thumbnails, formats });
    this.poses = null; // of models that move, where one has come in
    this.takesTextures = schema.scene.properties.textures !== undefined;
  }

  // Files that the person picks, one way or the other.
  async browse(way) {
    await this.take(await browse(ACCEPT), { way });
  }

  // One after the other. `way` is "open", for models and scenes in place of this scene, or "add"; without one the
  // person is asked about whole scenes. `at` is where files were dropped.
  async take(files, { at = null, way = null } = {}) {
    const known = [...files].sort((a, b) => ORDER.indexOf(kindOf(a)) - ORDER.indexOf(kindOf(b)));
    // An image that comes with a mesh is for that, wherever they fell.
    const place = known.some((file) => ["mesh", "scene"].includes(kindOf(file))) ? null : at;
    if (await this.#takeImages(known, at)) return;
    let next = way;
    for (const file of known) {
      try {
        if (await this.#take(file, place, next)) next = "add"; // the others of these files belong to it
      } catch (problem) {
        this.#refuse(file, problem);
      }
      this.messages.hide("upload");
    }
  }

  // Whether several images were a texture set: the server knows by their names, or by a file that comes with them.
  async #takeImages(files, at) {
    const isImage = (file) => ["image", "light"].includes(kindOf(file));
    const images = files.filter((file) => kindOf(file) === "image").length;
    const described = files.some(isMaterialX) && files.length > 1;
    if (!files.every((file) => isImage(file) || isMaterialX(file)) || (images < 2 && !described)) return false;
    const name = `${files.length} ${described ? "files" : "images"}`;
    try {
      const { zip } = await import("./lib/zip.js");
      const archive = await zip(files, name);
      await this.#takeMaterials(await this.upload(archive), archive, at);
      return true;
    } catch (problem) {
      if (problem.status === 422) return false; // one after the other, then
      this.#refuse({ name }, problem);
      return true;
    } finally {
      this.messages.hide("upload");
    }
  }

  #refuse(file, problem) {
    this.messages.show("refusal", {
      title: `${file.name} could not be used.`,
      detail: problemText(problem, {}, fileValueWords),
    });
  }

  // Whether a scene was opened.
  async #take(file, at, way) {
    const kind = kindOf(file);
    if (!kind) throw new Error(`Sunbox can open ${ACCEPT.replaceAll(",", ", ")}.`);
    if (kind === "json") return this.#takeJson(JSON.parse(await file.text()), file, way);
    const { readRecipe } = await import("./document/recipe-reader.js");
    const recipe = way === "add" ? null : await readRecipe(file); // what is added is an image like any other
    if (recipe) {
      this.reopen(recipe, stem(file));
      return true;
    }
    const { checkFile } = await import("./lib/check-file.js");
    await checkFile(file, this.formats());
    const one = await this.#uploadOne(file); // before anything is asked: a broken file is no whole scene
    return one && this.#takeUploaded(one.info, one.file, at, way);
  }

  async #takeUploaded(info, file, at, way) {
    if (info.kind === "materials") return this.#takeMaterials(info, file, at);
    if (info.kind === "scene") {
      this.messages.hide("upload");
      const chosen = way ?? (await this.#ask(file));
      return chosen === null ? false : this.#takeScene(info, file, chosen);
    }
    if (info.kind === "mesh") return this.#takeMesh(info, file, way);
    const kind = kindOf(file);
    if (kind === "table") this.#putTable(info, file);
    else if (kind === "measurement") await this.#takeMeasured(info, file, at);
    else if (kind === "light") this.acts.putEnvironment({ type: "image", asset: info.id }, undefined, file.name);
    else await this.#takeImage(info, file, at);
    return false;
  }

  // "add", "open", or null.
  #ask(file) {
    return question({
      title: `${file.name} is a whole scene`,
      detail: "Add its things to this scene, or open it in place of this one.",
      choices: [
        { label: "Add", value: "add" },
        { label: "Open", value: "open" },
      ],
    });
  }

  async #takeMaterials({ id }, file, at) {
    const { collected, heading, placed, thingFor } = await import("./texture-set.js");
    const { warnings, ...set } = await fetchAssetMaterials(id);
    const materials = unpacked(set);
    const thing = await thingFor(at, { controller: this.controller, state: this.acts.state });
    this.acts.change(collected(this.acts.state, thing, materials));
    const isOne = materials.length === 1;
    const lines = materials.flatMap((each) => {
      const known = fields(this.schema, materialModels(this.schema)[each.material.type]);
      return placed(each, Object.fromEntries(known.map(({ name, title }) => [name, title])), isOne);
    });
    const left = warnings.map(({ pointer: image, detail }) => `${image}: ${detail}.`);
    this.messages.show("import", { title: heading(materials, warnings), list: [...lines, ...left] });
    return false;
  }

  async #takeMeasured(info, file, at) {
    if (at !== null) await this.#aim(at, file);
    await this.acts.putFile(info.kind, info.id);
    const left = (info.warnings ?? []).map(warningText);
    if (left.length) this.messages.show("import", { title: `${file.name}: good to know.`, list: left });
  }

  // The id of a file that the person picks, or null; its name has one of these endings.
  async pick({ endings }) {
    const [file] = await browse(endings.join(","));
    if (!file) return null;
    try {
      return (await this.upload(file)).id;
    } catch (problem) {
      this.#refuse(file, problem);
      return null;
    } finally {
      this.messages.hide("upload");
    }
  }

  // Another file, {kind, endings}, for the material in hand.
  async replace(wanted) {
    const id = await this.pick(wanted);
    if (id) this.acts.putFile(wanted.kind, id);
  }

  async #takeImage(info, file, at) {
    const isCertain = at === null || (await this.#aim(at, file));
    this.#paint(this.#colorField(), info, file);
    if (isCertain) return;
    const material = inWords(this.acts.state.chosen.material);
    this.messages.show("import", {
      title: `${file.name} is on ${material}.`,
      detail: "The picture was not ready to tell what lies there, so the selected material got the image.",
    });
  }

  // Selects what an image fell on, if it is not the background; false where that can't be told.
  async #aim({ x, y }, file) {
    this.messages.show("upload", { title: `Finding the place of ${file.name}`, lasting: true });
    try {
      const shape = await this.controller.shapeAt(x, y);
      if (shape !== null) this.acts.select(pointer("shapes", shape));
      return true;
    } catch {
      return false; // no picture yet, or no connection: what was dropped must not be lost with it
    }
  }

  async upload(file, entry) {
    const set = this.messages.show("upload", { title: `Sending ${file.name}`, lasting: true, progress: true });
    return upload(file, set, entry);
  }

  // {info, file} of what a file is, or of the one of a zip's models that the person takes; null where they take none.
  async #uploadOne(file) {
    try {
      return { info: await this.upload(file), file };
    } catch (problem) {
      if (!problem.choices?.length) throw problem;
      this.messages.hide("upload");
      const { askModel } = await import("./zip-models.js");
      const entry = await askModel(file, problem.choices);
      return entry && { info: await this.upload(file, entry), file: new File([], entry.split("/").at(-1)) };
    }
  }

  async #takeJson(document, file, way) {
    const scene = document?.scene?.shapes ? document.scene : document?.shapes && document;
    const chosen = scene ? (way ?? (await this.#ask(file))) : "open";
    if (chosen === "add") return this.#addScene(scene, file);
    if (chosen === "open") this.openDocument(document, stem(file));
    return Boolean(scene) && chosen === "open";
  }

  // A scene, a material or a whole page's state, by what it holds.
  openDocument(document, name) {
    if (document?.scene?.shapes) this.acts.change(revived(document));
    else if (document?.shapes) this.acts.openScene(document, name);
    else if (materialModels(this.schema)[unpacked(document)[0]?.material?.type]) this.acts.putMaterial(document);
    else throw new Error("It holds neither a scene nor a material.");
  }

  async #takeScene(info, file, way) {
    const { id, exposure, warnings = [] } = info;
    const posed = await this.#posed(info, file, way);
    if (!posed) return false;
    const { document, bounds } = posed;
    const moves = info.animations && !info.variants ? await this.#poses() : null;
    const keep = (offset) => moves?.keep({ id, file, info, offset, shapes: document.shapes });
    if (way === "add") return this.#addScene(document, file, { bounds, warnings, keep });
    keep();
    const whole = bounds && { low: bounds[0], high: bounds[1] };
    if (whole) remember(document.shapes, whole);
    const standing = whole ? await this.#grounded(document, whole) : document;
    this.acts.openScene(standing, stem(file), exposure);
    const taken =
      exposure === undefined ? [] : [`The exposure was set to ${exposure} stops, to suit the model's lights.`];
    const studioToo = { label: "Add the studio", does: () => this.#addStudio(exposure) };
    this.#tell(file, [...taken, ...warnings], "good to know.", isUnderNoSky(document) ? studioToo : null);
    return true;
  }

  async #poses() {
    const { Poses } = await import("./poses.js");
    const { schema, acts } = this;
    this.poses ??= new Poses({ schema, acts, refuse: (file, problem) => this.#refuse(file, problem) });
    return this.poses;
  }

  // {document, bounds} of a scene's file, of one that has variants as the person wants it; null where not. One that
  // only moves is at rest, and can be posed in the inspector.
  async #posed({ id, bounds, ...info }, file, way) {
    if (!info.variants) return { document: named(await fetchAssetScene(id), file), bounds };
    const { askPose } = await import("./model-pose.js");
    const pose = await askPose(this.schema, file, { id, ...info }, { action: way === "add" ? "Add" : "Open" });
    if (!pose) return null;
    const posed = await fetchPosedScene(id, pose);
    return { ...posed, document: named(posed.document, file) };
  }

  // On a ground, where the model brings none.
  async #grounded(document, around) {
    const { grounded } = await import("./document/stage.js");
    return grounded(document, around, this.acts.plainMaterial);
  }

  // What a file says of its lights and cameras does not matter where these stay behind.
  async #addScene(document, file, { bounds, warnings = [], keep = () => {} } = {}) {
    keep(await this.adder.addScene(document, bounds ? { low: bounds[0], high: bounds[1] } : null));
    const left = document.lights?.length ?? 0;
    const told = left
      ? [
          `Its ${left === 1 ? "light was" : `${left} lights were`} left out, as this scene has its own. Open the file instead to bring all.`,
        ]
      : [];
    this.#tell(file, [...told, ...warnings.filter(({ pointer: about = "" }) => !STAYS.test(about))], "good to know.");
    return false;
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
    const list = warnings.map((each) => (typeof each === "string" ? each : warningText(each)));
    this.messages.show("import", { title: `${file.name}: ${what}`, list, action });
  }

  async #takeMesh({ id, bounds, warnings = [] }, file, way) {
    measure(id, bounds);
    const isOpened = way === "open";
    const whole = { low: bounds[0], high: bounds[1] };
    const names = { title: titleOf(file), name: stem(file) };
    if (isOpened) {
      this.acts.openScene(await this.#grounded(await this.#alone(id, names), whole), names.name);
      this.#tell(file, warnings, "good to know.");
      return true;
    }
    const factor = await this.adder.addMesh(id, names);
    const size = factor < 1 ? `1/${count(Math.round(1 / factor))} of` : `${count(factor)} times`;
    const scaled = `It is shown at ${size} its size, as its file does not say a unit. Scale is in the inspector.`;
    if (factor === 1) this.#tell(file, warnings, "good to know.");
    else this.#tell(file, [scaled, ...warnings], "good to know.");
    return false;
  }

  // A scene of one mesh alone, as the server frames and lights it, of a material that is named like the file.
  async #alone(id, { title, name }) {
    const document = await fetchAssetScene(id);
    return {
      ...document,
      materials: { [name]: this.acts.plainMaterial },
      shapes: document.shapes.map((shape) => ({ ...shape, name: title, material: name })),
    };
  }

  #colorField() {
    const { type } = this.acts.material;
    const field = fields(this.schema, materialModels(this.schema)[type]).find(
      ({ widget, takesTexture }) => widget === "color" && takesTexture,
    );
    return field && `${this.acts.materialPlace}/${field.name}`;
  }

  // A table of colours for the whole picture.
  async table(file) {
    try {
      this.#putTable(await this.upload(file), file);
    } catch (problem) {
      this.#refuse(file, problem);
    }
    this.messages.hide("upload");
  }

  #putTable({ id, kind }, file) {
    if (kind !== "lut") throw new Error("A .cube file is needed here.");
    this.acts.putTable(id, file.name);
  }

  // An image for a parameter.
  async texture(place, file) {
    try {
      await this.#paint(place, await this.upload(file), file);
    } catch (problem) {
      this.#refuse(file, problem);
    }
    this.messages.hide("upload");
  }

  #paint(place, { id, kind }, file) {
    if (!this.takesTextures || !place) throw new Error("This has no place for an image.");
    if (kind !== "image") throw new Error("An image is needed here: PNG, JPEG, WebP, EXR or HDR.");
    this.thumbnails.keep(id, file);
    this.acts.change(pictured(this.acts.state, place, id, stem(file)));
  }
}
