// What a person pastes elsewhere to make this very picture: a command, a program.

import { serverUrl } from "../server/api.js";

const NAMES = { true: "True", false: "False", null: "None" };

// A JSON value as Python writes it. JSON's strings are Python's, too.
function python(value, indent = "") {
  if (typeof value === "string") return JSON.stringify(value);
  if (value === null || typeof value !== "object") return NAMES[value] ?? String(value);
  const deeper = `${indent}    `;
  const isList = Array.isArray(value);
  const parts = isList
    ? value.map((each) => python(each, deeper))
    : Object.entries(value).map(([name, each]) => `${JSON.stringify(name)}: ${python(each, deeper)}`);
  const [open, close] = isList ? "[]" : "{}";
  const line = `${open}${parts.join(", ")}${close}`;
  if (line.length + indent.length <= 100 && !line.includes("\n")) return line;
  return `${open}\n${parts.map((part) => `${deeper}${part},\n`).join("")}${indent}${close}`;
}

export function pythonProgram(scene, settings, { exposure, tone_map, lut }) {
  const given = Object.entries(settings).map(([name, value]) => `    ${name}=${python(value)},\n`);
  return `# pip install ./client in a checkout of Sunbox; a key is read from SUNBOX_API_KEY
from sunbox import Client

scene = ${python(scene)}

with Client(${JSON.stringify(serverUrl())}) as client:
    picture = client.render(
        scene,
${given.map((line) => `    ${line}`).join("")}    )
    picture.save("sunbox.png", exposure=${python(exposure)}, tone_map=${python(tone_map)}${lut ? `, lut=${python(lut)}` : ""})
`;
}
