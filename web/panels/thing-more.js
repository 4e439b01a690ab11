// What the inspector shows of environments and of bodies besides their fields.

import { EnvironmentPart } from "./environment-part.js";
import { MediumPart } from "./medium-part.js";

export class ThingMore {
  constructor(find, parts) {
    this.environment = new EnvironmentPart(find("environment-ball"), parts.acts);
    this.medium = new MediumPart(find("medium-part"), parts);
  }

  // `thing`: what is selected, with its model `owner` of the schema.
  show(scene, thing, owner) {
    this.environment.show(thing === "/environment" ? (scene.environment ?? null) : null);
    this.medium.show(scene, { thing: owner?.properties.medium ? thing : null, owner });
  }

  mark(wrong, text) {
    return this.medium.mark(wrong, text);
  }

  forgive() {
    this.medium.forgive();
  }
}
