// JSON documents as values: nothing here changes its arguments.

export const isObject = (value) => value !== null && typeof value === "object" && !Array.isArray(value);

export function equal(a, b) {
  if (a === b) return true;
  if (a === null || b === null || typeof a !== "object" || typeof b !== "object") return false;
  if (Array.isArray(a) !== Array.isArray(b)) return false;
  const keys = Object.keys(a);
  return keys.length === Object.keys(b).length && keys.every((key) => key in b && equal(a[key], b[key]));
}

// RFC 7396, with the service's rule that a patch which changes an object's `type` replaces it whole.
export function merge(target, patch) {
  if (!isObject(patch)) return patch;
  const fresh = !isObject(target) || ("type" in patch && changesType(target, patch));
  const result = fresh ? {} : { ...target };
  for (const [key, value] of Object.entries(patch)) {
    if (value === null) delete result[key];
    else result[key] = merge(result[key], value);
  }
  return result;
}

// Only texts and absence count: in a table of materials, "type" may be somebody's material.
const changesType = (from, to) =>
  from.type !== to.type && [from.type, to.type].every((kind) => kind === undefined || typeof kind === "string");

// The patch that leads from one document to another, or undefined where they are the same.
export function diff(from, to) {
  if (from === to) return undefined;
  if (!isObject(from) || !isObject(to) || changesType(from, to)) return equal(from, to) ? undefined : to;
  const patch = {};
  for (const key of Object.keys(from)) if (to[key] === undefined) patch[key] = null;
  for (const [key, value] of Object.entries(to)) {
    const change = value === undefined ? undefined : diff(from[key], value);
    if (change !== undefined) patch[key] = change;
  }
  return Object.keys(patch).length ? patch : undefined;
}

const parts = (pointer) =>
  pointer
    .split("/")
    .slice(1)
    .map((part) => part.replaceAll("~1", "/").replaceAll("~0", "~"));

export const pointer = (...keys) =>
  keys.map((key) => `/${String(key).replaceAll("~", "~0").replaceAll("/", "~1")}`).join("");

// What an RFC 6901 pointer points at, or undefined.
export const at = (document, place) => parts(place).reduce((node, key) => node?.[key], document);

// The document with another value at the pointer; undefined takes the member away.
export function put(document, place, value) {
  const set = (node, [key, ...rest]) => {
    if (key === undefined) return value;
    const copy = Array.isArray(node) ? [...node] : { ...node };
    const child = set(copy[key], rest);
    if (child === undefined && !Array.isArray(copy)) delete copy[key];
    else copy[key] = child;
    return copy;
  };
  return set(document, parts(place));
}
