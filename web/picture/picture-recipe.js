// The page's own use of recipes: what a picture that leaves was made from, and a picture that comes back as a scene.

import { exactSettings } from "./export.js";
import { givenOf } from "../document/recipe.js";
import { defaults } from "../server/schema.js";

// `info()` is what the server said of itself, `size()` that of the picture on screen, `view()` how it is displayed;
// `viewDefaults` are the schema's.
export function pictureRecipes({ schema, acts, info, size, view, viewDefaults }) {
  // What the server takes for the settings that are not given.
  const base = (quality = schema.settings.properties.quality.default) => {
    const known = Object.entries(info().quality[quality]).filter(([name]) => name in schema.settings.properties);
    return { ...defaults(schema.settings, schema.settings), ...Object.fromEntries(known), quality };
  };
  return {
    // As the server writes it: all that is needed to make the picture again.
    madeFrom(scene, samples, { aov, bits = 8 }) {
      const { settings } = acts.state;
      const exact = exactSettings({ ...base(settings.quality), ...settings, ...size() }, samples);
      return { sunbox: info().version, scene, settings: exact, samples, view: { aov, ...view(), bits } };
    },
    reopen({ scene, settings, view: shown = {} }, title) {
      const { width, height, ...knobs } = settings;
      const { exposure, tone_map, lut = null } = { ...viewDefaults, ...shown };
      acts.openScene(scene, title, undefined, {
        settings: { ...givenOf(knobs, base(settings.quality)), width, height },
        view: givenOf({ exposure, tone_map, lut }, viewDefaults),
      });
    },
  };
}
