// Where a light has to stand for its reflection to lie at a point of the picture.

import { positionOf, swung } from "./lamps.js";
import { isLight } from "./kinds.js";
import { shifted, wrapped } from "./manipulation.js";
import { add, dot, length, normalize, scale, subtract } from "../lib/vector.js";

// The unit direction from which a mirror at a point sends light along the ray that came from the eye. The normal may be
// on either side.
export const mirrored = (way, normal) => normalize(subtract(way, scale(normal, 2 * dot(way, normal))));

// How far along a ray the sphere round a target is left, or null where the ray misses it.
function leaves(from, way, target, radius) {
  const arm = subtract(from, target);
  const middle = -dot(arm, way);
  const square = middle * middle - dot(arm, arm) + radius * radius;
  const far = middle + Math.sqrt(Math.max(square, 0));
  return square >= 0 && far > 0 ? far : null;
}

// The light put where a ray leaves the sphere on which it slides round its target; where the ray misses that sphere, at the
// same distance from the point. What has a direction alone comes from there.
export function putOnRay(document, target, { point, way }) {
  if (isLight(document) && !document.position) return swung(document, target, scale(document.direction, -1), way);
  const arm = subtract(positionOf(document), target);
  const radius = length(arm);
  const to = add(point, scale(way, leaves(point, way, target, radius) ?? radius));
  const turned = swung(document, target, arm, subtract(to, target));
  return shifted(turned, subtract(to, positionOf(turned)));
}

const heading = ([x, , z]) => (Math.atan2(x, z) * 180) / Math.PI;

// The rotation, in degrees, that brings a direction of an environment, as it is at rotation 0, under another one.
export const rotationTo = (own, way) => wrapped(heading(way) - heading(own));
