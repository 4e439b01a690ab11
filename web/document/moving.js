// Shapes in other places.

import { KINDS } from "./shapes.js";
import { translated } from "./transforms.js";
import { add, tidy } from "../lib/vector.js";

// A shape in another place, by an offset in metres.
export function moved(shape, offset) {
  const by = (point) => tidy(add(point, offset));
  const { matrix } = shape.transform ?? {};
  if (matrix) return { ...shape, transform: { matrix: translated(matrix, by([matrix[3], matrix[7], matrix[11]])) } };
  const kind = KINDS[shape.type];
  if (shape.transform || !kind.moved) {
    const { translate = [0, 0, 0] } = shape.transform ?? {};
    return { ...shape, transform: { ...shape.transform, translate: by(translate) } };
  }
  return kind.moved(shape, by);
}
