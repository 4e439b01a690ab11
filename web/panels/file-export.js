// A scene as a file for another program, and what that has no place for.

import { exportScene } from "../server/api.js";
import { lossText } from "../server/problem-text.js";
import { sceneFile } from "../document/file-name.js";
import { saveAs } from "../lib/files.js";

const MOST = 8; // lines of losses that are shown; the rest is counted

// Where equal things are lost in many places, the first of them is named.
function linesOf(lost, titles) {
  const byDetail = new Map();
  for (const loss of lost) {
    const known = byDetail.get(loss.detail);
    if (known) known.count += loss.count ?? 1;
    else byDetail.set(loss.detail, { ...loss, count: loss.count ?? 1 });
  }
  const lines = [...byDetail.values()].map((loss) => lossText(loss, titles));
  if (lines.length <= MOST) return lines;
  const more = lines.length - MOST;
  return [...lines.slice(0, MOST), `And ${more} more.`];
}

// `acts`: title(), scene(), titles() of fields, messages, announce(text).
export async function exportFile(format, acts) {
  const { blob, lost, ending } = await exportScene(acts.scene(), format);
  saveAs(blob, sceneFile(acts.title(), ending));
  if (!lost.length) {
    acts.messages.hide("export");
    return acts.announce("Exported, with nothing lost.");
  }
  acts.messages.show("export", {
    title: "Exported.",
    detail: "This format cannot hold some of the scene:",
    list: linesOf(lost, acts.titles()),
  });
}
