// The rotation of the environment, on the shelf beside the pictures of environments. Where the inspector shows the
// environment, its own field takes this one's place (shelf.css): two of one name would be one too many.

import { schemaForm } from "../forms/schema-form.js";
import { environmentModels, fields } from "../server/schema.js";

const NAME = "rotation";

export class EnvironmentTurn {
  #type = null; // of the environment that the form is made for

  // `root` is its place on the page; `schema` of the scene; `acts` the editor.
  constructor(root, { schema, acts }) {
    Object.assign(this, { root, schema, acts });
    acts.subscribe(() => this.show());
    this.show();
  }

  show() {
    const { environment } = this.acts.state.scene;
    this.root.hidden = !environment;
    if (!environment) return;
    if (environment.type !== this.#type) this.#make(environment.type);
    this.form.show(environment);
  }

  #make(type) {
    this.#type = type;
    const own = fields(this.schema, environmentModels(this.schema)[type]).filter(({ name }) => name === NAME);
    this.form = schemaForm(own, {
      change: (name, value) => this.acts.edit(`/scene/environment/${name}`, value),
      commit: () => this.acts.endGesture(),
      forgive: () => this.acts.forgive(),
    });
    this.root.replaceChildren(this.form.element);
    this.root.querySelector("input[type=range]")?.setAttribute("aria-label", "Environment rotation");
  }
}
