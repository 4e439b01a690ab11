// The parts of the page that can wait until the first picture is there, each on demand: final pictures, the comparison,
// files that come in and things that are added, what the header's buttons open, small pictures of textures.

import { materialModels, blackMaterial } from "./server/schema.js";
import { namesOf } from "./document/page-state.js";
import { isUncharted } from "./document/textures.js";
import { OnDemand, useSheet } from "./lib/on-demand.js";

// `titleOf(chosen)` is the scene's name in words; `push()` tells the streams what is wanted.
export function laterParts({
  find,
  schema,
  page,
  editor,
  ui,
  stream,
  viewport,
  controller,
  messages,
  titleOf,
  push,
  complain,
  say,
}) {
  const title = () => titleOf(editor.state.chosen) || "Your own scene";

  const recipes = new OnDemand(
    () => import("./picture/picture-recipe.js"),
    ({ pictureRecipes }) =>
      pictureRecipes({
        schema,
        acts: editor,
        info: () => page.info,
        size: () => page.size,
        view: () => page.view,
        viewDefaults: page.viewDefaults,
      }),
    { complain },
  );

  const comparison = new OnDemand(
    async () => {
      const [module] = await Promise.all([import("./compare/comparison.js"), useSheet("compare.css")]);
      return module;
    },
    ({ Comparison }) =>
      new Comparison(
        {
          root: find("comparison"),
          stage: find("stage"),
          divider: find("divider"),
          canvas: find("picture-b"),
          difference: find("difference"),
        },
        {
          first: viewport,
          acts: editor,
          models: Object.keys(materialModels(schema.scene)),
          names: namesOf,
          headerOfA: () => page.header,
        },
      ),
    { complain, arrived: () => push() },
  );
  comparison.nears(find("compare")); // it is large, and not everybody compares

  const textures = new OnDemand(
    () => import("./forms/texture-thumbnails.js"),
    ({ TextureThumbnails }) => new TextureThumbnails(blackMaterial(schema.scene)),
    { complain },
  );

  const adder = new OnDemand(
    () => import("./adding.js"),
    ({ Adder }) => new Adder({ acts: editor, controller }),
    { complain },
  );

  const importer = new OnDemand(
    () => import("./importer.js"),
    async ({ Importer }) => {
      const [beside, thumbnails, { reopen }] = await Promise.all([adder.get(), textures.get(), recipes.get()]);
      const formats = () => page.info?.formats ?? {};
      return new Importer({ schema, acts: editor, adder: beside, messages, controller, reopen, thumbnails, formats });
    },
    { complain },
  );

  const menus = new OnDemand(
    () => import("./header.js"),
    async ({ makeHeader }) =>
      makeHeader({
        find,
        schema,
        page,
        editor,
        stream,
        recipes: await recipes.get(),
        messages,
        titleOf,
        openFiles: () => importer.calls("browse")("open"),
        addFiles: () => importer.calls("browse")("add"),
        complain,
        say,
      }),
    { complain },
  );
  for (const id of ["page-save", "export-menu", "readings"]) menus.opens(find(id));
  menus.answers(find("share"));

  const stage = new OnDemand(
    () => import("./panels/stage-menu.js"),
    ({ StageMenu }) =>
      new StageMenu(find, {
        acts: editor,
        put: adder.calls("stage"),
        schema: schema.scene,
        turning: { page, stage: find("stage"), isNew: () => stream.isNewest(page.painted), push },
        say,
      }),
    { complain },
  );
  stage.opens(find("stage-menu"));

  const finals = new OnDemand(
    async () => {
      const [module] = await Promise.all([import("./renders/final-pictures.js"), useSheet("renders.css")]);
      return module;
    },
    async ({ FinalPictures }) => {
      const made = await recipes.get();
      return new FinalPictures({
        find,
        schema,
        page,
        editor,
        ui,
        messages,
        recipes: made,
        title,
        compareWith: (render) => editor.compareWith(render),
        complain,
        say,
      });
    },
    { complain, arrived: (made) => page.info && made.show() },
  );

  const sweep = new OnDemand(
    async () => {
      const [module] = await Promise.all([import("./panels/sweep.js"), useSheet("sweep.css")]);
      return module;
    },
    ({ Sweep }) => new Sweep({ schema, page, acts: editor, say }),
    { complain },
  );
  let touched; // the parameter that a hand was at last
  for (const kind of ["focusin", "pointerdown", "input"])
    find("material-form").addEventListener(kind, ({ target }) => {
      touched = target.closest("[data-field]")?.dataset.field ?? touched;
    });
  sweep.nears(find("sweep-material"));
  find("sweep-material").addEventListener("click", () => sweep.calls("open")(touched, find("material-more")));

  const turn = new OnDemand(
    () => import("./panels/environment-turn.js"),
    ({ EnvironmentTurn }) => new EnvironmentTurn(find("environment-turn"), { schema: schema.scene, acts: editor }),
    { complain },
  );
  turn.nears(find("tab-environments"));

  const all = [textures, adder, importer, menus, finals, controller.tools];
  return {
    comparison,
    textures,
    // Calls `refuse()`, unless what was refused is an image on a thing without texture coordinates: it lies by box then.
    mend(problem, refuse) {
      if (!isUncharted(problem)) return refuse();
      return import("./document/by-box.js")
        .then(({ lieByBox }) => lieByBox({ acts: editor, messages, problem, refuse }))
        .catch(refuse);
    },
    adder,
    importer,
    menus,
    finals,
    // Has them ready for a hand, now that nothing waits for the network.
    prepare() {
      const modules = [import("./document/dressing.js"), import("./lib/ask.js"), import("./lib/name-entry.js")];
      if (ui.state.drawer === "environments") turn.get().catch(complain);
      return Promise.allSettled([...all.map((part) => part.get()), ...modules]);
    },
  };
}
