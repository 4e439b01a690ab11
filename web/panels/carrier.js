// A material that is carried from the shelf to a thing, in the picture or in the outline. The thing is pointed out
// while the hand is over it; only letting go is a change, for which the renderer may have to prepare something.

import { pointer } from "../lib/patch.js";

const TYPE = "application/x-sunbox-material";

export class Carrier {
  #what = null; // what is carried from this page: a promise of {name} or {document, wanted}
  #place = null; // where the hand is: {x, y} over the picture, {thing} over the outline, null elsewhere
  #shown = null; // the thing that is pointed out
  #isFollowing = false;

  // `acts` the editor; `stage` and `outline` elements; `shapeAt(x, y)` resolves to the index of the shape there or null,
  // which is quick after `prepare()`; `point(index)` points it out, or nothing for null; `open(parcel)` resolves to what is
  // carried; `say(text)` reads out.
  constructor({ acts, stage, outline, shapeAt, point, prepare, open, say }) {
    Object.assign(this, { acts, stage, outline, shapeAt, point, prepare, open, say });
    for (const target of [stage, outline]) {
      target.addEventListener("dragover", (event) => {
        if (!event.dataTransfer.types.includes(TYPE)) return;
        event.preventDefault();
        this.#follow(this.#placeOf(event));
      });
      target.addEventListener("dragleave", ({ relatedTarget }) => {
        if (!target.contains(relatedTarget)) this.#follow(null);
      });
      target.addEventListener("drop", (event) => {
        const parcel = event.dataTransfer.getData(TYPE);
        if (!parcel) return;
        event.preventDefault();
        this.#drop(this.#placeOf(event), this.#what ?? this.open(JSON.parse(parcel)));
      });
    }
  }

  // What PictureList does with an option that is dragged; `wrap(value)` gives its parcel, {name} or {library}.
  source(wrap) {
    return {
      take: (value, dataTransfer) => {
        const parcel = wrap(value);
        dataTransfer?.setData(TYPE, JSON.stringify(parcel));
        this.#what = this.open(parcel);
        this.#what.catch(() => {}); // said when it is let go
        this.prepare();
      },
      move: (x, y) => this.#follow(this.#placeAt(x, y)),
      drop: (x, y) => this.#drop(this.#placeAt(x, y), this.#what),
      leave: () => this.#end(),
    };
  }

  #placeAt(x, y) {
    const target = document.elementFromPoint(x, y);
    return target ? this.#placeOf({ target, clientX: x, clientY: y }) : null;
  }

  #placeOf({ target, clientX: x, clientY: y }) {
    if (this.stage.contains(target)) return { x, y };
    const { thing } = target.closest("[data-thing^='/shapes/']")?.dataset ?? {};
    return this.outline.contains(target) && thing ? { thing } : null;
  }

  async #thingAt(place) {
    if (!place || place.thing) return place?.thing ?? null;
    const shape = await this.shapeAt(place.x, place.y);
    return shape === null ? null : pointer("shapes", shape);
  }

  // Points out what the hand is over, one thing after the other; places that it has left meanwhile are passed over.
  async #follow(place) {
    this.#place = place;
    if (this.#isFollowing) return;
    this.#isFollowing = true;
    for (let seen; seen !== this.#place; ) {
      seen = this.#place;
      this.#pointOut(await this.#thingAt(seen).catch(() => null));
    }
    this.#isFollowing = false;
  }

  #pointOut(thing) {
    if (thing === this.#shown) return;
    this.#shown = thing;
    this.point(thing === null ? null : Number(thing.split("/")[2]));
    for (const row of this.outline.querySelectorAll("[data-thing]"))
      row.classList.toggle("under-hand", row.dataset.thing === thing);
  }

  #end() {
    this.#what = this.#place = null;
    this.#pointOut(null);
  }

  async #drop(place, what) {
    this.#end();
    try {
      const thing = await this.#thingAt(place);
      const { name, ...other } = thing ? await what : {};
      if (name !== undefined) this.acts.wear([thing], name);
      else if (thing) await this.acts.dress([thing], other);
      else this.say("There is no thing there to put the material on.");
    } catch (problem) {
      this.acts.complain(problem);
    }
  }
}
