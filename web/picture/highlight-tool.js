// A click that says where a highlight has to lie: the chosen light is put, or the environment turned, so that the thing
// under the click mirrors it to the eye.

import { eye, ray } from "../document/camera.js";
import { mirrored, putOnRay, rotationTo } from "../document/highlights.js";
import { lampsOf, targetOf } from "../document/lamps.js";
import { isOn } from "../document/outline.js";
import { add, length, scale } from "../lib/vector.js";
import { ballsOf, brightestOf } from "./environment-ball.js";

const CHOOSE = "Select a light or the environment first.";

// The mirrored ray {point, way} at a place of the picture, or null where nothing is.
async function mirroredAt(picker, scene, camera, place, aspect) {
  const depth = await picker.depth(scene, place);
  const normal = depth > 0 ? await picker.normal(scene, place) : null;
  if (!normal || !(length(normal) > 0)) return null;
  const through = [camera, place.x, place.y, aspect];
  const way = ray(...through);
  return { point: add(eye(...through), scale(way, depth)), way: mirrored(way, scale(normal, 1 / length(normal))) };
}

// `acts` is the editor, `picker` tells what lies at `place`; `aspect` of the picture. `say(text)`. Raises an Error with
// words for the user where there is nothing to put.
export async function placeHighlight({ acts, picker, say }, place, aspect) {
  const { scene, chosen } = acts.state;
  const { thing } = chosen;
  const lamp = lampsOf(scene).find((each) => each.thing === thing)?.document;
  const isEnvironment = thing === "/environment" && scene.environment;
  if (!lamp && !isEnvironment) throw new Error(CHOOSE);
  if (isOn(acts.state, "locked", [thing])) return say("It is locked");
  const balls = isEnvironment ? ballsOf(scene.environment) : null;
  const found = await mirroredAt(picker, scene, acts.camera, place, aspect);
  if (!found) return say("There is nothing there that could show a highlight");
  if (isEnvironment) {
    const own = brightestOf(await balls);
    if (!own) return say("This environment is the same on all sides, so turning it changes nothing");
    const rotation = rotationTo(own, found.way);
    acts.edit("/scene/environment/rotation", rotation, null);
    return say(`Environment turned to ${rotation}°`);
  }
  const target = targetOf(scene, lamp, acts.camera);
  acts.edit(`/scene${thing}`, putOnRay(lamp, target, found), null);
  say("The highlight is there");
}
