// What the page needs before it can begin: the schema, the library, and what to show first.

import { Problem, fetchPreset, fetchSchema } from "./server/api.js";
import { askForKey } from "./server/key.js";
import { openLibrary } from "./forms/library.js";
import { readLink, revived } from "./document/share.js";
import { lastWork } from "./document/work.js";

const FIRST_SCENE = "shader-ball";
const BOOT_RETRY_MS = 1500;

// What the address or the last visit left: {state, from} or null. A bad link is told and passed over.
async function left(complain, asked) {
  const work = await lastWork();
  try {
    const linked = await readLink();
    if (linked) return { state: revived(linked), from: "link" };
  } catch (error) {
    complain(new Error(`This link could not be opened. ${error.message}`));
  }
  return work?.scene && !asked ? { state: revived(work), from: "work" } : null;
}

// {schema, library, name, scene, left}. Asks until the server answers; `told(problem)` says why it waits.
// The address may ask for a built-in scene once: #scene=cornell-boxes. A reload goes on with the work.
export async function boot({ keyDialog, told, complain }) {
  const asked = new URLSearchParams(location.hash.slice(1)).get("scene");
  if (asked) history.replaceState(null, "", location.pathname + location.search);
  for (let wasWrong = false; ; ) {
    try {
      const [schema, library] = await Promise.all([fetchSchema(), openLibrary()]);
      const names = library.scenes.map(({ name }) => name);
      const name = [asked, FIRST_SCENE, names[0]].find((each) => names.includes(each));
      const scene = await fetchPreset("scenes", name);
      told(null);
      return { schema, library, name, scene, left: await left(complain, asked) };
    } catch (problem) {
      if (problem instanceof Problem && problem.status === 401) {
        await askForKey(keyDialog, wasWrong);
        wasWrong = true;
      } else {
        told(problem);
        await new Promise((wake) => {
          setTimeout(wake, BOOT_RETRY_MS);
        });
      }
    }
  }
}
