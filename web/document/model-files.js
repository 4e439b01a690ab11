// Models of materials that are of a file, which the person is asked for.

import { fields, materialModels } from "../server/schema.js";

// The parameter of a model without which there is none of it: one that names a file; else undefined.
const fileField = (schema, type) =>
  fields(schema, materialModels(schema)[type]).find(({ widget, required }) => widget === "file" && required);

// What a model needs of files by its parameters' names: {} where nothing, null where the person has none.
// `ask({kind, endings})` promises the id of a file, or null.
export async function filesFor(schema, type, ask) {
  const field = fileField(schema, type);
  if (!field) return {};
  const id = await ask(field.file);
  return id ? { [field.name]: id } : null;
}

// What a file of this kind makes of a material: {type, name}, the model and its parameter.
export function modelOfFile(schema, kind) {
  const types = Object.keys(materialModels(schema));
  const type = types.find((each) => fileField(schema, each)?.file.kind === kind);
  return { type, name: fileField(schema, type).name };
}
