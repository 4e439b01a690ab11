// The server's JSON Schema, read as the editor needs it: which models there are and which fields they
// have, with range, default, unit and hint. No range and no default is repeated in JavaScript.

// A node with its references followed; what stands beside a reference wins.
function resolve(schema, node) {
  if (!node?.$ref) return node ?? {};
  const target = node.$ref
    .split("/")
    .slice(1)
    .reduce((place, key) => place[key], schema);
  const { $ref, ...beside } = node;
  return { ...resolve(schema, target), ...beside };
}

const branches = (schema, node) => {
  const options = node.anyOf ?? node.oneOf;
  return options
    ? options.map((option) => resolve(schema, option)).filter((option) => option.type !== "null")
    : [node];
};

// What a property of a model is: the model's schema after references and optional wrappers.
export function property(schema, model, name) {
  return resolve(schema, resolve(schema, model).properties[name]);
}

// The models that a union offers, by the value of their `type`: {type: model, ...}.
export function variants(schema, union) {
  const found = {};
  const visit = (node) => {
    const kind = node.properties?.type;
    if (kind) found[kind.const ?? kind.enum?.[0] ?? kind.default] = node;
    else if (node.anyOf || node.oneOf) branches(schema, node).forEach(visit);
  };
  visit(resolve(schema, union));
  return found;
}

// The model of a property that is one, be it optional.
export const model = (schema, owner, name) =>
  branches(schema, property(schema, owner, name)).find((node) => node.properties);

export const materialModels = (schema) =>
  variants(schema, property(schema, schema, "materials").additionalProperties);
// How models of materials are called, where that is not their `type` in words: {type: name}.
export const modelNames = (schema) =>
  Object.fromEntries(
    Object.entries(materialModels(schema)).flatMap(([type, { "x-name": name }]) => (name ? [[type, name]] : [])),
  );
// The simplest material, which the schema names first, reflecting nothing.
export function blackMaterial(schema) {
  const [[type, simplest]] = Object.entries(materialModels(schema));
  const asked = fields(schema, simplest).filter(({ required }) => required);
  return { type, ...Object.fromEntries(asked.map(({ name }) => [name, 0])) };
}
// What a thing is made of that nobody has given anything else.
export const newMaterial = (schema) => property(schema, schema, "materials")["x-new"];
export const cameraModels = (schema) => variants(schema, property(schema, schema, "camera"));
export const environmentModels = (schema) => variants(schema, schema.properties.environment);
export const shapeModels = (schema) => variants(schema, schema.properties.shapes.items);
export const lightModels = (schema) => variants(schema, schema.properties.lights.items);
// Of a texture: one that is made from nothing says its type, the other is an image.
export function textureModel(schema, { type }) {
  const union = property(schema, schema, "textures").additionalProperties;
  return (
    variants(schema, union)[type] ?? branches(schema, resolve(schema, union)).find((node) => !node.properties?.type)
  );
}
export const transformModel = (schema) =>
  branches(schema, property(schema, Object.values(shapeModels(schema))[0], "transform")).find(
    (node) => node.properties?.translate,
  );

const bound = (nodes, key) => nodes.map((node) => node[key]).find((value) => value !== undefined);

function step(min, max, whole) {
  if (whole) return 1;
  // About two hundred to two thousand steps from end to end, and a round number.
  return Number.isFinite(max - min) ? 10 ** Math.ceil(Math.log10((max - min) / 500)) : 0.01;
}

function field(schema, name, raw, required) {
  const top = resolve(schema, raw);
  const options = branches(schema, top);
  const nodes = [top, ...options];
  const color = bound(nodes, "x-widget") === "color";
  const numeric = options.find((node) => ["number", "integer"].includes(node.type));
  const vector =
    !color &&
    options.find((node) => node.type === "array" && [2, 3].includes(node.maxItems) && node.items?.type === "number");
  const reference = options.find((node) => node.properties?.texture);
  const whole = !options.some((node) => node.type === "number");
  const limits = [top, ...(numeric ? [numeric] : [])];
  const choices = bound(nodes, "enum");
  const pair = choices && options.find((node) => node.type === "array" && node.maxItems === 2 && node.items?.enum);
  const open = { min: bound(limits, "exclusiveMinimum"), max: bound(limits, "exclusiveMaximum") };
  const min = bound(limits, "minimum") ?? open.min;
  const max = bound(limits, "maximum") ?? open.max;
  const soft = { min: bound(nodes, "x-soft-minimum") ?? min, max: bound(nodes, "x-soft-maximum") ?? max };
  const file = bound(nodes, "x-asset");
  const usual = color
    ? "color"
    : vector
      ? "vector"
      : choices
        ? (pair && "choices") || "choice"
        : options.some((node) => node.type === "boolean")
          ? "toggle"
          : numeric
            ? (bound(nodes, "x-widget") ?? "number")
            : reference
              ? "texture"
              : bound(nodes, "x-widget") === "text"
                ? "text"
                : null;
  const log = bound(nodes, "x-log");
  const widget = file ? "file" : log ? (color ? "amounts" : "amount") : usual;
  if (!widget || bound(nodes, "const") !== undefined) return null;
  return {
    name,
    widget,
    file,
    choices,
    min,
    max,
    open,
    required,
    takesTexture: reference !== undefined,
    reference,
    length: vector?.maxItems,
    title: top.title ?? name,
    group: bound(nodes, "x-group"),
    hint: bound(nodes, "description") ?? "",
    unit: bound(nodes, "x-unit") ?? "",
    soft: log && soft.min === open.min ? { ...soft, min: log } : soft,
    log,
    step: step(soft.min, soft.max, whole && !color),
    whole,
    initial: top.default ?? undefined,
    absent: bound(nodes, "x-absent"),
    follows: bound(nodes, "x-follows"),
    ranges: bound(nodes, "x-ranges"),
    used: bound(nodes, "x-used"),
    unless: bound(nodes, "x-unless"),
    beside: bound(nodes, "x-beside"),
    example: bound(nodes, "examples")?.[0],
    // What a material has three of is one for each channel; anywhere else three numbers go along the axes.
    isPerChannel: Boolean(vector && numeric && bound(nodes, "x-group")),
  };
}

// The fields of a model that a control can be made for; names, lists and fixed members have none.
export function fields(schema, owner) {
  const { properties = {}, required = [] } = resolve(schema, owner);
  return Object.entries(properties)
    .map(([name, raw]) => field(schema, name, raw, required.includes(name)))
    .filter((found) => found !== null);
}

// The value that a field without one follows from another, or undefined: that one may be a texture.
export function followed({ follows }, value) {
  if (!follows || typeof value !== "number") return undefined;
  const { points } = follows;
  const to = Math.max(
    1,
    points.findIndex(([x]) => x >= value),
  );
  const [[x0, y0], [x1, y1]] = [points[to - 1], points[to]];
  return Number((y0 + ((y1 - y0) * (value - x0)) / (x1 - x0)).toPrecision(3));
}

// What the schema says where a document is silent, for all or some of a model's members.
export function defaults(schema, owner, names = Object.keys(owner.properties)) {
  const known = names.map((name) => [name, property(schema, owner, name).default]);
  return Object.fromEntries(known.filter(([, value]) => value !== undefined && value !== null));
}
