// The sheet that explains the keys and what fingers do.

import { element } from "./lib/dom.js";

const FINGERS = [
  "Fingers on the picture",
  [
    ["drag", "orbit"],
    ["two fingers", "slide the view"],
    ["pinch", "come nearer, go away"],
    ["tap", "select a thing and its material"],
  ],
];
const MOVES = [
  [
    "The picture",
    [
      ["drag", "orbit"],
      ["Shift", "drag", "slide the view; also the right button, or two fingers"],
      ["scroll", "come nearer, go away; also a pinch"],
      ["Alt", "drag", "turn the environment"],
      ["Alt", "click", "put the highlight of the chosen light, or of the environment, there"],
      ["click", "select a thing and its material"],
      ["←", "→", "↑", "↓", "orbit; with Shift slide"],
      ["←", "→", "↑", "↓", "with Move, Rotate or Scale: change the selection by a step; with Shift by ten"],
      ["Page up", "Page down", "with Move: raise and lower the selection; with Rotate: roll it"],
      ["Ctrl", "drag", "of a handle: turn by 15°, move without snapping to the ground"],
      ["+", "−", "come nearer, go away"],
      ["W", "A", "S", "D", "fly; E rises, Q sinks"],
    ],
  ],
];

const NAMES = { " ": "Space", escape: "Esc", home: "Home", delete: "Del" };
const shown = ({ keys: [key], ctrl, shift }) => [
  ...(ctrl ? ["Ctrl"] : []),
  ...(shift ? ["Shift"] : []),
  NAMES[key] ?? (key.length === 1 ? key.toUpperCase() : key),
];

// The sheet: every act with its keys, by groups; what fingers do comes first where there are fingers.
export function fillSheet(root, acts) {
  const isTouched = matchMedia("(pointer: coarse)").matches;
  const groups = new Map(
    (isTouched ? [FINGERS, ...MOVES] : MOVES).map(([name, rows]) => [
      name,
      rows.map((row) => [row.slice(0, -1), row.at(-1)]),
    ]),
  );
  for (const act of acts) {
    if (!groups.has(act.group)) groups.set(act.group, []);
    groups.get(act.group).push([shown(act), act.says]);
  }
  root.replaceChildren(
    ...[...groups].map(([name, rows]) =>
      element(
        "section",
        {},
        element("h3", {}, name),
        element(
          "dl",
          {},
          ...rows.flatMap(([keys, says]) => [
            element("dt", {}, ...keys.flatMap((key) => [element("kbd", {}, key), " "])),
            element("dd", {}, says),
          ]),
        ),
      ),
    ),
  );
}
