// What a scene consists of, in the order in which a list shows it.

import { isLamp } from "./lamps.js";
import { inWords } from "../lib/format-text.js";
import { pointer } from "../lib/patch.js";

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
    ...lights.map(({ type }, i) => ({
      thing: pointer("lights", i),
      icon: "light",
      title: title(`${type} light`),
      note: "",
    })),
    ...shapes.map((shape, i) => ({
      thing: pointer("shapes", i),
      icon: isLamp(scene, shape) ? "light" : shape.type,
      title: title(isLamp(scene, shape) ? `${shape.type === "quad" ? "area" : shape.type} light` : shape.type),
      note: shape.material,
    })),
  ];
}
