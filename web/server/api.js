// Every URL and every message shape of the service, in one place. URLs are relative to the page,
// so that the editor works under a subpath too.

import { readKey } from "./key.js";

const root = new URL("v1/", document.baseURI);

const PROTOCOL = "sunbox.v1";
const LOOK_MS = 1000; // between two looks at how far a comparison is

// What the service refused, as RFC 9457 tells it: `detail`, `status`, `errors` [{pointer, detail}] and, of a
// zip with several models, their names as `choices`.
export class Problem extends Error {
  // `type` is "about:blank" where only the status says what is wrong.
  constructor({ type = "about:blank", title, detail, status, errors = [], choices = [] }) {
    super(detail || title || "The server refused the request.");
    this.isGeneric = type === "about:blank";
    this.title = title;
    this.status = status;
    this.errors = errors;
    this.choices = choices;
  }
}

const authorization = () => (readKey() ? { authorization: `Bearer ${readKey()}` } : {});

async function ask(method, path, { body, headers = {}, signal, keepalive } = {}) {
  const response = await fetch(new URL(path, root), {
    method,
    body,
    signal,
    keepalive,
    headers: { accept: "application/json", ...authorization(), ...headers },
  }).catch((error) => {
    throw error.name === "AbortError" ? error : new Error("The server does not answer. Your work is safe here.");
  });
  if (response.ok) return response;
  const told = await response.json().catch(() => ({}));
  throw new Problem({ status: response.status, title: response.statusText, ...told });
}

const json = (document) => ({ body: JSON.stringify(document), headers: { "content-type": "application/json" } });
const get = async (path) => (await ask("GET", path)).json();

export const fetchSchema = () => get("schema");
export const listPresets = (kind) => get(`presets/${kind}`);
export const fetchPreset = (kind, name) => get(`presets/${kind}/${encodeURIComponent(name)}`);

// Any words can be a document's title. Its name is a part of the address, and the few words that cannot be one
// (a slash, or nothing but one or two dots) are replaced by their look-alikes.
const nameOf = (title) =>
  title.replaceAll("/", "\u2215").replace(/^\.{1,2}$/, (dots) => dots.replaceAll(".", "\u2024"));
const saved = (kind, name) => `documents/${kind}/${encodeURIComponent(nameOf(name))}`;
export const listSaved = (kind) => get(`documents/${kind}`);
export const fetchSaved = (kind, name) => get(saved(kind, name));
export const save = (kind, title, document, query = {}) =>
  ask("PUT", `${saved(kind, title)}?${new URLSearchParams({ title, ...query })}`, json(document));
export const forget = (kind, name) => ask("DELETE", saved(kind, name));

// As JSON it would be what the asset is.
export const fetchAsset = async (id) => (await ask("GET", `assets/${id}`, { headers: { accept: "*/*" } })).blob();
// What an asset is: {kind, bounds, triangles, ...}.
export const describeAsset = (id) => get(`assets/${id}`);
export const fetchAssetMaterials = (id) => get(`assets/${id}/materials`);
export const fetchAssetScene = (id) => get(`assets/${id}/scene`);

// A scene's file as `pose` {variant, animation, time} has it: {document, bounds}, its corners.
export async function fetchPosedScene(id, pose, signal) {
  const answer = await ask("GET", `assets/${id}/scene?${new URLSearchParams(pose)}`, { signal });
  return { document: await answer.json(), bounds: JSON.parse(answer.headers.get("sunbox-bounds")) };
}

// A small picture of a scene, as a PNG.
export const renderPicture = async (scene, settings, signal) =>
  (await ask("POST", "render?format=png", { ...json({ scene, settings }), signal })).blob();

// The linear values of such a picture, as the bytes of a .npy file.
export const renderValues = async (scene, settings) =>
  (await ask("POST", "render?format=npy", json({ scene, settings }))).arrayBuffer();

// What the shader functions say of a material: `question` is "" for values, "/albedo" or "/terms".
export const askBsdf = async (question, body) => (await ask("POST", `bsdf${question}`, json(body))).json();

// {material, lost}: a material as one of the model `to`, with values of that model's menus.
export const convertMaterial = async (material, to, choose) =>
  (await ask("POST", "materials/convert", json({ material, to, choose }))).json();

// A render as a job of the server's: {id, ...}. `key` is the page's own name for the request: sent twice it is one render.
export const submitRender = async (order, key) =>
  (
    await ask("POST", "renders", { ...json(order), headers: { ...json(order).headers, "idempotency-key": key } })
  ).json();
// One's own renders, the newest first, and whether there are more of them.
export async function listRenders(query) {
  const response = await ask("GET", `renders?${new URLSearchParams(query)}`);
  return { renders: await response.json(), hasMore: response.headers.has("link") };
}
export const renderStatus = (id) => get(`renders/${id}`);
// A body that renders the same picture again: {scene, settings}.
export const renderScene = (id) => get(`renders/${id}/scene`);
// Its picture so far. `progress(bytes, total)` is called as it comes; `signal` ends it.
export async function renderImage(id, query, { progress = () => {}, signal } = {}) {
  const response = await ask("GET", `renders/${id}/image?${new URLSearchParams(query)}`, { signal });
  const total = Number(response.headers.get("content-length")) || null;
  const parts = [];
  let bytes = 0;
  for await (const part of response.body) {
    parts.push(part);
    progress((bytes += part.length), total);
  }
  return new Blob(parts, { type: response.headers.get("content-type") });
}
// Resolves once the server has made that file, which is not fetched yet.
export const prepareImage = async (id, query) => {
  const response = await ask("GET", `renders/${id}/image?${new URLSearchParams(query)}`);
  await response.body.cancel();
};
// Cancels one that has not ended; its picture so far stays. Deletes one that has.
export const deleteRender = (id, options) => ask("DELETE", `renders/${id}`, options);

// Renders of one scene along axes: {scene, settings, over, ...} gives {id, renders: N}.
export const startBatch = async (order) => (await ask("POST", "batches", json(order))).json();
export const batchStatus = (id) => get(`batches/${id}`);
// Deletes one that has ended, with its renders. `keepalive`: the page may be closed meanwhile.
export const cancelBatch = (id) => ask("DELETE", `batches/${id}`, { keepalive: true });

// What lies between two pictures, each {scene, settings} or the id of a render: {verdict, blob}, the latter a map of "p",
// "flip" or what else the server draws. More samples are taken while it is undecided; `signal` ends that, and
// `progress({samples, max_samples})` hears how many.
export async function compareMap(a, b, map, { signal, progress }) {
  const name = crypto.getRandomValues(new Uint32Array(3)).join("-");
  const query = new URLSearchParams({ format: "png", map, name });
  const looking = setInterval(async () => {
    const response = await ask("GET", `compare/${name}`, { signal }).catch(() => null); // the answer itself tells why
    if (response?.status === 200) progress(await response.json());
  }, LOOK_MS);
  try {
    const response = await ask("POST", `compare?${query}`, { ...json({ a, b }), signal });
    return { verdict: JSON.parse(response.headers.get("sunbox-verdict")), blob: await response.blob() };
  } finally {
    clearInterval(looking);
  }
}

// A scene as a file of that format, what it loses, and how such a file's name ends.
export async function exportScene(scene, format) {
  const response = await ask("POST", "export", json({ scene, format }));
  const [, ending] = /\.(\w+)"$/.exec(response.headers.get("content-disposition"));
  return { blob: await response.blob(), lost: JSON.parse(response.headers.get("sunbox-lost")), ending };
}

export const serverUrl = () => new URL("..", root).href.replace(/\/$/, "");

export const renderUrl = (query) => new URL(`render?${new URLSearchParams(query)}`, root).href;

// Uploads a file, or of a zip of several models that which `entry` names: what the server says of it, {id, kind, ...}.
// `progress(share)` is told how much has gone.
export function upload(file, progress, entry) {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest(); // fetch does not tell how far a body is
    const query = new URLSearchParams({ filename: file.name.slice(-200), ...(entry ? { entry } : {}) });
    request.open("POST", new URL(`assets?${query}`, root));
    for (const [name, value] of Object.entries(authorization())) request.setRequestHeader(name, value);
    request.setRequestHeader("content-type", "application/octet-stream");
    request.responseType = "json";
    request.upload.onprogress = ({ loaded, total }) => progress(total ? loaded / total : 0);
    request.onload = () => {
      const told = request.response ?? {};
      if (request.status < 300) resolve(told);
      else reject(new Problem({ status: request.status, title: request.statusText, ...told }));
    };
    request.onerror = () => reject(new Error("The connection was lost on the way."));
    request.send(file);
  });
}

// Where the stream is; `session` takes up one that was cut off.
export function streamUrl(session) {
  const url = new URL("stream", root);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  if (session) url.searchParams.set("session", session);
  return url.href;
}

export const streamProtocols = () => (readKey() ? [PROTOCOL, `sunbox.key.${readKey()}`] : [PROTOCOL]);

export const message = {
  start: (generation, { scene, settings, view }) => ({ type: "start", generation, scene, settings, view }),
  update: (generation, patch) => ({ type: "update", generation, ...patch }),
  view: (view) => ({ type: "view", ...view }),
  ack: (seq) => ({ type: "ack", seq }),
  pause: () => ({ type: "pause" }),
  resume: () => ({ type: "resume" }),
  ping: () => ({ type: "ping" }),
};

// A binary frame: u32 little-endian length, that much JSON, the image's bytes.
export function parseFrame(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  return { header, bytes: buffer.slice(4 + length) };
}
