// What the header's buttons open: the scene's menu, what can be exported, a link; and the pill's readings.

import { amount, inWords } from "./lib/format-text.js";
import { watchMenu } from "./lib/menu.js";
import { essence, linkTo, revived } from "./document/share.js";
import { WhenClean } from "./panels/when-clean.js";
import { ExportMenu, handOut } from "./panels/export-menu.js";
import { SceneMenu } from "./panels/scene-menu.js";
import * as exporting from "./picture/export.js";
import { fieldTitles } from "./server/problem-text.js";

// `titleOf(chosen)` is the scene's name in words; `recipes` as pictureRecipes has them.
export function makeHeader({
  find,
  schema,
  page,
  editor,
  stream,
  recipes,
  messages,
  titleOf,
  openFiles,
  addFiles,
  complain,
  say,
}) {
  const tellOf = (title, below) => messages.show("share", { title, below });
  const sceneMenu = new SceneMenu(find("page-save"), {
    acts: {
      scene: () => editor.state.scene,
      title: () => titleOf(editor.state.chosen),
      open: (document, title) => editor.openScene(document, title),
      named: (title) => editor.amend({ chosen: { ...editor.state.chosen, scene: title } }),
      state: () => essence(editor.state),
      restore: (kept) => editor.change(revived(kept)),
      async snapshot() {
        const { bytes, header } = await stream.capture({ format: "jpeg", quality: 85, aov: "color" });
        return { blob: new Blob([bytes], { type: header.mime }), note: amount(header.samples, "sample") };
      },
      openFiles,
      addFiles,
      showKeys: () => find("help").click(),
      toggleTheme: () => find("theme").click(),
      complain,
      announce: say,
    },
  });
  const shownSettings = () => exporting.exactSettings(page.settings, page.header?.samples ?? 1);
  const whenClean = new WhenClean({ page, editor, messages });
  const exportMenu = new ExportMenu(find("export-menu"), {
    title: () => titleOf(editor.state.chosen) || "Your own scene",
    isWanted: () => whenClean.isWanted(),
    scene: () => editor.state.scene,
    material: () => editor.materialSet,
    link: () => linkTo(editor.state),
    made() {
      const { chosen } = editor.state;
      return [chosen.material, inWords(editor.material.type)].join(", ");
    },
    png: (bits) => exporting.png(stream, bits, recipes.madeFrom),
    exr: () => exporting.exr(stream, page.layers, recipes.madeFrom),
    command: () => exporting.curl(editor.state.scene, shownSettings(), page.view),
    async program() {
      const { pythonProgram } = await import("./picture/program.js");
      return pythonProgram(editor.state.scene, shownSettings(), page.view);
    },
    formats: () => page.info?.formats.exports ?? [],
    titles: () => fieldTitles(schema.scene),
    messages,
    show: tellOf,
    complain,
    announce: say,
  });
  watchMenu(find("scene-menu"), find("page-save"), { opened: () => sceneMenu.refresh() });
  watchMenu(find("export"), find("export-menu"), { opened: () => exportMenu.refresh() });
  watchMenu(find("readings-button"), find("readings"));
  find("share").addEventListener("click", async () => {
    try {
      await handOut(await linkTo(editor.state), "The link", { show: tellOf, announce: say });
    } catch (error) {
      complain(error);
    }
  });
  return { sceneMenu, exportMenu };
}
