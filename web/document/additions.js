import { LIGHTS } from "./lights.js";
import { KINDS, LAMPS } from "./shapes.js";
import { lightModels, shapeModels } from "../server/schema.js";

// New things: [{title, kind, make(camera, radius, material)}], in the middle of what is looked at, and lights, which have
// `shines` in the place of `make`: their type; `carries`: all things stand on it.
export function additions(schema) {
  const shapes = shapeModels(schema);
  const lights = lightModels(schema);
  const near = ({ target }) => target.map((x) => Number(x.toFixed(3)));
  const bodies = Object.entries(KINDS).flatMap(([type, { title, make }]) =>
    make ? [{ title, kind: "shapes", needs: shapes[type], make: (camera, r, name) => make(near(camera), r, name) }] : [],
  );
  const lamps = LAMPS.map((type) => ({
    title: KINDS[type].lamp.title,
    kind: "shapes",
    needs: shapes[type],
    shines: type,
  }));
  const others = Object.entries(LIGHTS).map(([type, { title }]) => ({
    title,
    kind: "lights",
    needs: lights[type],
    shines: type,
  }));
  const all = [...bodies, { title: "Ground", needs: shapes.quad, carries: true }, ...lamps, ...others];
  return all.filter(({ needs }) => needs);
}
