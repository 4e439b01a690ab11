// The drawing of the handles: arrows, rings and squares around a point of the scene, in an SVG over the picture. What can
// be dragged has `data-handle` and a margin to hit.

import { axes, project } from "../document/camera.js";
import { add, cross, dot, normalize, scale, subtract } from "../lib/vector.js";
import { NAMES, RING_PX, WORLD, metresPerPixel } from "./handle-drags.js";

const SVG = "http://www.w3.org/2000/svg";
const POINTS = 48; // of a ring
const PLANE = [0.3, 0.55]; // where the square of a plane begins and ends, in lengths of an arrow
const SHORT_PX = 14; // an arrow that points at the eye is too short to be dragged
const FACING = 0.2; // the cosine below which a plane is seen too edge-on to be dragged
const HEAD_PX = 12;

// An SVG element with attributes and children.
export function shape(tag, attributes, ...children) {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  node.append(...children);
  return node;
}

const pathOf = (points) => `M${points.map(([x, y]) => `${x.toFixed(1)} ${y.toFixed(1)}`).join("L")}`;

// A handle: what is seen, and before it what can be hit.
const handle = (name, { hit, seen, kind = "" }) =>
  shape(
    "g",
    { "data-handle": name, class: `handle ${kind} ${name.slice(-1).toLowerCase()}` },
    shape("path", { d: hit ?? seen, class: "hit" }),
    shape("path", { d: seen, class: "seen" }),
  );

function arrow(name, middle, end, isSquare) {
  const way = subtract(end, middle);
  if (Math.hypot(...way) < SHORT_PX) return null;
  const [x, y] = normalize(way);
  const begin = add(middle, [x * 12, y * 12]);
  const tip = (forward, side) => add(end, [forward * x - side * y, forward * y + side * x]);
  const head = isSquare
    ? [tip(-5, -5), tip(5, -5), tip(5, 5), tip(-5, 5)]
    : [tip(-2, -5.5), tip(HEAD_PX - 2, 0), tip(-2, 5.5)];
  return handle(name, { hit: pathOf([begin, tip(6, 0)]), seen: `${pathOf([begin, end])}${pathOf(head)}Z` });
}

function disc([x, y], radius) {
  return `M${x - radius} ${y}a${radius} ${radius} 0 1 0 ${2 * radius} 0a${radius} ${radius} 0 1 0 ${-2 * radius} 0Z`;
}

// The half of a ring that faces the eye.
function ring(pivot, axis, reach, eye, onto) {
  const across = normalize(
    cross(axis, Math.abs(dot(axis, eye)) > 0.999 ? WORLD.find((each) => Math.abs(dot(each, axis)) < 0.8) : eye),
  );
  const front = cross(across, axis); // of all directions in its plane the one nearest to the eye
  const isWhole = Math.abs(dot(axis, eye)) > 0.95;
  const most = isWhole ? Math.PI : Math.PI / 2;
  return Array.from({ length: POINTS + 1 }, (_, i) => {
    const angle = most * ((2 * i) / POINTS - 1);
    return onto(add(pivot, add(scale(front, reach * Math.cos(angle)), scale(across, reach * Math.sin(angle)))));
  });
}

// Puts the handles of a mode (move, rotate, scale) around a pivot, along three unit axes. `only`: the name of the one
// axis that counts, or null; `dragged`: the handle in the hand; `words` beside it.
export function drawHandles(root, { mode, view, pivot, axes: own, only, dragged, words }) {
  const { camera, aspect, height } = view;
  const onto = (point) => {
    const { x, y } = project(camera, point, aspect);
    return [x * aspect * height, y * height];
  };
  const eye = normalize(subtract(camera.position, pivot));
  if (dot(axes(camera).forward, eye) > -0.02) return root.replaceChildren(); // beside or behind the eye
  const reach = RING_PX * metresPerPixel(view, pivot);
  const middle = onto(pivot);
  const isOn = (name) => (!only || only === name) && (!dragged || dragged === name);
  const nodes = [];
  if (mode === "rotate") {
    if (!only && isOn("view")) {
      const seen = disc(middle, RING_PX + 14);
      nodes.push(handle("view", { seen, kind: "ring" }));
    }
    own.forEach((axis, k) => {
      if (isOn(NAMES[k]))
        nodes.push(handle(NAMES[k], { seen: pathOf(ring(pivot, axis, reach, eye, onto)), kind: "ring" }));
    });
  } else {
    if (mode === "move") {
      own.forEach((axis, k) => {
        const name = `plane ${NAMES[k]}`;
        if (!isOn(name) || Math.abs(dot(axis, eye)) < FACING) return;
        const [u, v] = own.filter((_, i) => i !== k);
        const corner = (a, b) => onto(add(pivot, add(scale(u, a * reach), scale(v, b * reach))));
        const [low, high] = PLANE;
        const seen = `${pathOf([corner(low, low), corner(high, low), corner(high, high), corner(low, high)])}Z`;
        nodes.push(handle(name, { seen, kind: "plane" }));
      });
    }
    // The nearer an arrow comes to the eye, the later it is drawn.
    own
      .map((axis, k) => ({ axis, name: NAMES[k] }))
      .sort((a, b) => dot(a.axis, eye) - dot(b.axis, eye))
      .forEach(({ axis, name }) => {
        if (isOn(name)) nodes.push(arrow(name, middle, onto(add(pivot, scale(axis, reach))), mode === "scale"));
      });
    if (isOn("view")) nodes.push(handle("view", { seen: disc(middle, 7), hit: disc(middle, 10), kind: "disc" }));
  }
  if (words) {
    const [x, y] = middle;
    nodes.push(shape("text", { x: x + 12, y: y - RING_PX - 22, class: "words", "text-anchor": "middle" }, words));
  }
  root.replaceChildren(...nodes.filter(Boolean));
}
