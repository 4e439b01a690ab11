// Materials turned into other models, which the server does; an answer is asked for once.

import { convertMaterial } from "../server/api.js";

const MOST = 64; // answers that stay

export class Conversions {
  #answers = new Map(); // by what was asked: a promise of a material

  // The material as one of the model `to`; `choose` are values of that model's menus.
  to(material, to, choose = {}) {
    const key = JSON.stringify([material, to, choose]);
    if (!this.#answers.has(key)) {
      if (this.#answers.size === MOST) this.#answers.delete(this.#answers.keys().next().value);
      const answer = convertMaterial(material, to, choose).then(({ material: made }) => made);
      answer.catch(() => this.#answers.delete(key));
      this.#answers.set(key, answer);
    }
    return this.#answers.get(key);
  }
}

// The documents that a material was turned from, for whoever goes back without an edit between.
export class Origins {
  #made = new Map(); // by place: {made, from: {type: material}}

  // What the document at a place was as a model of this type, or undefined.
  of(place, document, type) {
    return this.#from(place, document)[type];
  }

  keep(place, document, made) {
    this.#made.set(place, { made, from: { ...this.#from(place, document), [document.type]: document } });
  }

  #from(place, document) {
    const { made, from } = this.#made.get(place) ?? {};
    return made === document ? from : {};
  }
}
