// What the inspector shows of environments, of bodies and of lamps besides their fields.

import { EnvironmentPart } from "./environment-part.js";
import { LampPart } from "./lamp-part.js";
import { MediumPart } from "./medium-part.js";

export class ThingMore {
  constructor(find, parts) {
    this.environment = new EnvironmentPart(find("environment-ball"), parts.acts);
    this.medium = new MediumPart(find("medium-part"), parts);
    this.lamp = new LampPart(find("lamp-part"), parts);
  }

  // `thing`: what is selected, with its model `owner` of the schema, and whether it is shown as a lamp.
  show(scene, thing, owner, isLamp) {
    this.lamp.show(scene, { thing: isLamp ? thing : null, owner });
    this.environment.show(thing === "/environment" ? (scene.environment ?? null) : null);
    this.medium.show(scene, { thing: owner?.properties.medium ? thing : null, owner });
  }

  mark(wrong, text) {
    return this.medium.mark(wrong, text) ?? this.lamp.mark(wrong, text);
  }

  forgive() {
    this.medium.forgive();
    this.lamp.forgive();
  }
}
