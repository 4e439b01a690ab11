// Which of the models in a zip is meant.

import { askWhich } from "./lib/ask.js";

// The path of one of them in the zip, or null.
export const askModel = (file, paths) =>
  askWhich({
    title: `${file.name} holds ${paths.length} models`,
    label: "Model",
    options: paths.map((path) => ({ value: path, title: shortened(path, paths) })),
    action: "Take it",
  });

// Without the folders in which all of them are.
function shortened(path, paths) {
  const steps = path.split("/");
  const parts = (step, i) => i + 1 === steps.length || paths.some((each) => each.split("/")[i] !== step);
  return steps.slice(steps.findIndex(parts)).join("/");
}
