import { LIGHTS, SHAPES } from "./kinds.js";
import { lightModels, shapeModels } from "../server/schema.js";

// New things: [{title, kind, type}], in the middle of what is looked at, and lights, which have `shines`; `carries`: all
// things stand on it.
export function additions(schema) {
  const [shapes, lights] = [shapeModels(schema), lightModels(schema)];
  const listed = Object.entries(SHAPES).map(([type, row]) => ({ kind: "shapes", type, ...row }));
  const lamps = listed.filter(({ lamp }) => lamp).sort((a, b) => a.place - b.place);
  return [
    ...listed.filter(({ title, type }) => title && shapes[type]),
    ...(shapes.quad ? [{ title: "Ground", carries: true }] : []),
    ...lamps.filter(({ type }) => shapes[type]).map((row) => ({ ...row, title: row.lamp, shines: true })),
    ...Object.entries(LIGHTS).flatMap(([type, { title }]) =>
      lights[type] ? [{ kind: "lights", type, title, shines: true }] : [],
    ),
  ];
}
