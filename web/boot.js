// What the page needs before it can begin: the schema, the library, and what to show first.

import { Problem, fetchPreset, fetchSchema } from "./server/api.js";
import { openLibrary } from "./forms/library.js";
import { watchImages } from "./lib/dom.js";
import { askForKey } from "./server/key.js";
import { readLink, revived } from "./document/share.js";
import { lastWork } from "./document/work.js";

const FIRST_SCENE = "shader-ball";
const BOOT_RETRY_MS = 1500;

// What the address or the last visit left: {state, from} or null. A bad link is told and passed over.
async function left(complain, asked, work) {
  try {
    const linked = await readLink();
    if (linked) return { state: revived(linked), from: "link" };
  } catch (error) {
    complain(new Error(`This link could not be opened. ${error.message}`));
  }
  return work?.scene && !asked ? { state: revived(work), from: "work" } : null;
}

// {schema, library, name, scene, left}. Asks until the server answers; `told(problem)` says why it waits.
// The address may ask for a built-in scene once: #scene=cornell-boxes. A reload goes on with the work. `begins(work, name)`
// is told at once what is to be shown: the work of the last visit or null, else a built-in scene; of a link nothing.
export async function boot({ keyDialog, told, complain, begins }) {
  watchImages(document);
  const asked = new URLSearchParams(location.hash.slice(1)).get("scene");
  if (asked) history.replaceState(null, "", location.pathname + location.search);
  const isLink = new URLSearchParams(location.hash.slice(1)).has("v");
  const work = await lastWork();
  if (!isLink) begins(work?.scene && !asked ? work : null, asked ?? FIRST_SCENE);
  for (let wasWrong = false; ; ) {
    try {
      const [schema, library] = await Promise.all([fetchSchema(), openLibrary()]);
      const names = library.scenes.map(({ name }) => name);
      const name = [asked, FIRST_SCENE, names[0]].find((each) => names.includes(each));
      const scene = await fetchPreset("scenes", name);
      told(null);
      return { schema, library, name, scene, left: await left(complain, asked, work) };
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
