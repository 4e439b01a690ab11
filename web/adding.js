// Things that come into the scene: made here, copied, or from files. They stand beside what is there, and in sight.

import { box, remember } from "./document/bounds.js";
import { isFlat } from "./document/kinds.js";
import { axes, halfHeight, isInSight } from "./document/camera.js";
import { fresh } from "./document/materials.js";
import { adapted } from "./document/merging.js";
import { at, pointer } from "./lib/patch.js";
import { lampShape, standOf, subjectOf } from "./document/lamps.js";
import { LIGHTS } from "./document/lights.js";
import { isLamp } from "./document/emission.js";
import { ballOf, floors, lookedAt, middle, sized, solids, standing, union, wayOut } from "./document/placing.js";
import { KINDS } from "./document/shapes.js";
import { moved } from "./document/moving.js";
import { add, normalize, scale, turn } from "./lib/vector.js";

const COMPANION = 4; // times a new thing's size: a larger neighbour does not get into the picture with it
const SMALL = 0.2; // of what is made here: what is smaller in the picture is not seen there
const SUNS_APART = Math.PI / 6; // a copied sun shines from another side

// A name like one that there is, with a number that is free: "Wheel 2".
function another(name, all) {
  const [stem] = name.split(/ \d+$/);
  const taken = new Set(all.map((each) => each.name));
  let i = 2;
  while (taken.has(`${stem} ${i}`)) i += 1;
  return `${stem} ${i}`;
}

// The box around a scene: by its shapes, else by what its camera has in view.
function sizeOf({ shapes }, camera) {
  const known = shapes.filter((shape) => !isFlat(shape)).map(box);
  if (known.length && known.every(Boolean)) return union(known);
  const reach = halfHeight(camera, axes(camera).distance);
  return { low: camera.target.map((x) => x - reach), high: camera.target.map((x) => x + reach) };
}

export class Adder {
  // `acts` is the editor, `controller` knows what is seen.
  constructor({ acts, controller }) {
    Object.assign(this, { acts, controller });
  }

  // One of `additions`.
  async add({ title, type, shines, carries }) {
    const { acts } = this;
    if (carries) return this.stage("ground");
    if (shines) return this.#addLight(title, type);
    const { materials } = acts.state.scene;
    const material = fresh(title, materials);
    const center = acts.camera.target.map((x) => Number(x.toFixed(3)));
    const made = KINDS[type].make(center, this.controller.radius(), material);
    const around = await this.#surroundings();
    return this.#put([made], { materials: { [material]: acts.plainMaterial }, around, stands: !isFlat(made) });
  }

  // Has all things stand on a "ground" or a "cyclorama", in the place of the one that there was; "none" takes it away.
  async stage(kind) {
    const boxes = await this.controller.boxes();
    try {
      const { staged } = await import("./document/stage.js");
      this.acts.change(await staged(this.acts, boxes, kind));
    } catch (problem) {
      this.acts.complain(problem);
    }
  }

  // A light that is aimed at the selection, from a side where none is, and half a stop over what is there.
  async #addLight(title, type) {
    const { acts } = this;
    const { scene, chosen, view } = acts.state;
    const subject = subjectOf(scene, chosen.thing, acts.camera);
    const stand = standOf(scene, acts.camera, subject);
    const { toLight, distance, position } = stand;
    const irradiance = await this.controller.irradianceFor(subject.shapes, toLight, view.exposure ?? 0);
    const power = (factor) => Number((irradiance * factor).toPrecision(2));
    const direction = toLight.map((x) => Number((-x).toPrecision(4)) + 0);
    if (LIGHTS[type]) {
      const { make } = LIGHTS[type];
      return acts.add("lights", this.#apart(make({ position, direction, radius: subject.radius, distance, power })));
    }
    const material = fresh(title, acts.state.scene.materials);
    const { shape, area } = lampShape(type, stand, subject, material);
    const own = { ...acts.blackMaterial, emission: power((distance * distance) / area) };
    return acts.add("shapes", shape, { materials: { ...acts.state.scene.materials, [material]: own } });
  }

  async duplicate(thing) {
    const [, kind] = thing.split("/");
    const { scene } = this.acts.state;
    const original = at(scene, thing);
    const copy = original.name ? { ...original, name: another(original.name, scene[kind]) } : original;
    if (kind === "lights") return this.acts.add(kind, this.#apart(copy));
    const own = (await this.controller.boxes())[Number(thing.split("/")[2])];
    if (own && solids([own], this.acts.camera.position).length)
      return this.#put([copy], { own, around: await this.#surroundings() });
    // A floor or a wall comes in front of itself; what can't be measured goes aside.
    const away = isFlat(original) ? normalize(KINDS[original.type].normal(original)) : axes(this.acts.camera).right;
    return this.acts.add(kind, moved(copy, scale(away, this.controller.radius())));
  }

  // A light that is not where another one is.
  #apart(light) {
    const { lights = [] } = this.acts.state.scene;
    const { right } = axes(this.acts.camera);
    const isTaken = ({ position, direction }) =>
      lights.some(
        (each) =>
          String(each.position) === String(position) &&
          (position !== undefined || String(each.direction) === String(direction)),
      );
    let placed = light;
    for (let i = 0; i <= lights.length && isTaken(placed); i += 1) {
      placed = placed.position
        ? {
            ...placed,
            position: add(placed.position, scale(right, this.controller.radius())).map((x) =>
              Number(x.toPrecision(4)),
            ),
          }
        : {
            ...placed,
            direction: turn(placed.direction, [0, 1, 0], SUNS_APART).map((x) => Number(x.toPrecision(4))),
          };
    }
    return placed;
  }

  // A mesh with a material of its own, called as its file is. Such files do not say their unit: a model that is out of
  // all proportion becomes as large as its neighbours, by a power of ten, which is promised.
  async addMesh(asset, { title, name }) {
    const material = fresh(name, this.acts.state.scene.materials);
    const shape = { type: "mesh", name: title, asset, material };
    const own = box(shape);
    const around = await this.#surroundings();
    const beside = lookedAt(around.bodies, this.acts.camera.target);
    const factor = own ? sized(ballOf(own), beside ? ballOf(beside).radius : this.controller.radius()) : 1;
    const made = factor === 1 ? shape : { ...shape, transform: { scale: factor } };
    this.#put([made], { materials: { [material]: this.acts.plainMaterial }, around, stands: true, isFramed: true });
    return factor;
  }

  // The things of another scene; `whole` is the box around them, where that is known. Promises how far they were moved.
  async addScene(document, whole) {
    const { shapes, ...others } = adapted(document, this.acts.state.scene);
    const own = whole ?? sizeOf(document, this.acts.cameraOf(document));
    return this.#put(shapes, { ...others, own, around: await this.#surroundings(), stands: true, isFramed: true });
  }

  // What stands around, {bodies}, and on what, {grounds}.
  async #surroundings() {
    const boxes = await this.controller.boxes();
    const { scene } = this.acts.state;
    const { position } = this.acts.camera;
    const isBody = (_, i) => !scene.shapes[i] || !(isFlat(scene.shapes[i]) || isLamp(scene, scene.shapes[i]));
    return { bodies: solids(boxes.filter(isBody), position), grounds: floors(boxes, position) };
  }

  // Adds shapes as one thing, with materials and textures that the scene lacks. `own` is their box where the
  // shapes themselves don't tell; the camera goes to them where it can't see them, or hardly (`isFramed`). Returns how
  // far they were moved.
  #put(shapes, { materials = {}, textures = {}, own = union(shapes.map(box).filter(Boolean)), around, ...how }) {
    const { scene, chosen } = this.acts.state;
    const { camera } = this.acts;
    const { bodies } = around;
    const right = axes(camera).right;
    const aside = () => wayOut(own, bodies, right);
    const lost = () => !isInSight(camera, this.controller.aspect, { low: middle(own), high: middle(own) });
    const stood = () => standing(own, { ...around, target: camera.target, right, lost: lost() });
    const way = own && (how.stands ? stood() : aside());
    const isMoved = way?.offset.some((x) => x !== 0);
    const placed = isMoved ? shapes.map((shape) => moved(shape, way.offset)) : shapes;
    const stand = isMoved ? { low: add(own.low, way.offset), high: add(own.high, way.offset) } : own;
    if (stand) remember(placed, stand);
    const isSeen =
      !stand || (isInSight(camera, this.controller.aspect, stand) && !(how.isFramed && this.#isSmall(stand)));
    this.acts.change({
      scene: {
        ...scene,
        ...(Object.keys(textures).length ? { textures: { ...scene.textures, ...textures } } : {}),
        materials: { ...scene.materials, ...materials },
        shapes: [...scene.shapes, ...placed],
        camera: isSeen ? scene.camera : { ...scene.camera, ...this.#framed(stand, way?.neighbour, bodies) },
      },
      chosen: { ...chosen, thing: pointer("shapes", scene.shapes.length), material: placed[0].material },
    });
    return isMoved ? way.offset : [0, 0, 0];
  }

  // Whether a thing is hardly seen: its ball is smaller than a new thing's would be.
  #isSmall(stand) {
    return ballOf(stand).radius < SMALL * this.controller.radius();
  }

  // With the neighbour, or with what the camera looks at, unless the new thing would be lost beside that.
  #framed(stand, neighbour, bodies) {
    const company = neighbour ?? lookedAt(bodies, this.acts.camera.target);
    const [ball, other] = [stand, company].map((each) => each && ballOf(each));
    if (!(ball.radius > 0)) return {};
    const isBoth = other && other.radius < COMPANION * ball.radius;
    return this.controller.framed(isBoth ? ballOf(union([stand, company])) : ball);
  }
}
