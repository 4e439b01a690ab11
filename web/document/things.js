// What a scene consists of, in the order in which a list shows it.

import { isLamp } from "./emission.js";
import { SHAPES } from "./kinds.js";
import { inWords } from "../lib/format-text.js";
import { pointer } from "../lib/patch.js";

// The last part of a name, which may be a path.
const own = (name = "") => name.split("/").filter(Boolean).at(-1) ?? "";

// [{thing, icon, title, note}] of a scene.
export function things(scene) {
  const { environment, lights = [], shapes } = scene;
  const count = {};
  const title = (type) => {
    count[type] = (count[type] ?? 0) + 1;
    return count[type] > 1 ? `${inWords(type)} ${count[type]}` : inWords(type);
  };
  return [
    { thing: "/camera", icon: "camera", title: "Camera", note: "" },
    {
      thing: "/environment",
      icon: "environment",
      title: "Environment",
      note: environment ? inWords(environment.type) : "None",
    },
    ...lights.map(({ name, type }, i) => ({
      thing: pointer("lights", i),
      icon: "light",
      title: own(name) || title(`${type} light`),
      note: "",
    })),
    ...shapes.map((shape, i) => {
      const kind = isLamp(scene, shape) ? `${SHAPES[shape.type]?.word ?? shape.type} light` : shape.type;
      const told = own(shape.name) || title(kind);
      return {
        thing: pointer("shapes", i),
        icon: isLamp(scene, shape) ? "light" : shape.type,
        title: told,
        note: shape.material.toLowerCase() === told.toLowerCase() ? "" : shape.material, // not the same word twice
      };
    }),
  ];
}
