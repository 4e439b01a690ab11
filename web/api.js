// Every URL and every message shape of the service, in one place. URLs are relative to the page,
// so that the editor works under a subpath too.

const root = new URL("v1/", document.baseURI);

export const PROTOCOL = "sunbox.v1";

// What the service refused, as RFC 9457 tells it: `detail`, `status` and `errors` [{pointer, detail}].
export class Problem extends Error {
  constructor({ title, detail, status, errors = [] }) {
    super(detail || title || "The server refused the request.");
    this.title = title;
    this.status = status;
    this.errors = errors;
  }
}

async function get(path) {
  const response = await fetch(new URL(path, root), { headers: { accept: "application/json" } });
  const body = await response.json().catch(() => ({}));
  if (!response.ok) throw new Problem({ status: response.status, title: response.statusText, ...body });
  return body;
}

export const fetchSchema = () => get("schema");
export const listPresets = (kind) => get(`presets/${kind}`);
export const fetchPreset = (kind, name) => get(`presets/${kind}/${encodeURIComponent(name)}`);

export function streamUrl() {
  const url = new URL("stream", root);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  return url.href;
}

export const message = {
  start: (generation, { scene, settings, view }) => ({ type: "start", generation, scene, settings, view }),
  update: (generation, patch) => ({ type: "update", generation, ...patch }),
  view: (view) => ({ type: "view", ...view }),
  ack: (seq) => ({ type: "ack", seq }),
  pause: () => ({ type: "pause" }),
  resume: () => ({ type: "resume" }),
};

// A binary frame: u32 little-endian length, that much JSON, the image's bytes.
export function parseFrame(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  return { header, blob: new Blob([new Uint8Array(buffer, 4 + length)], { type: header.mime }) };
}
