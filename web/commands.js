// What the keys and the tools' buttons can do, with the words that explain it: [{keys, shift, ctrl, does, says, group}].

const TOOLS = {
  orbit: "orbit and select", fly: "look around", focus: "focus by clicking", inspect: "zoom to pixels; arrows move the cross",
};

// `does` has an act for each name below; `toggle(overlay)` and `pickTool(tool)` serve several.
export function commands(does) {
  const { toggle, pickTool } = does;
  return [
    { keys: ["z"], ctrl: true, shift: false, does: does.undo, says: "undo, also the camera", group: "Work" },
    { keys: ["z"], ctrl: true, shift: true, does: does.redo, says: "redo", group: "Work" },
    { keys: ["y"], ctrl: true, does: does.redo, says: "redo", group: "Work" },
    { keys: ["c"], ctrl: true, notInText: true, does: does.copyMaterial, says: "copy the material", group: "Work" },
    { keys: ["v"], ctrl: true, notInText: true, does: does.pasteMaterial, says: "paste a material or a scene", group: "Work" },
    { keys: ["delete"], does: does.remove, says: "delete the selected thing", group: "Work" },
    { keys: ["o"], ctrl: true, does: does.openFiles, says: "open a model or a scene", group: "Work" },
    { keys: [" "], does: does.togglePause, says: "pause, resume", group: "Work" },
    { keys: ["p"], does: does.download, says: "the picture as a PNG", group: "Work" },
    { keys: ["n"], does: does.snapshot, says: "take a snapshot", group: "Work" },
    ...Object.entries(TOOLS).map(([tool, says], i) => ({ keys: [String(i + 1)], does: () => pickTool(tool), says, group: "Tools" })),
    { keys: ["f"], does: does.frame, says: "frame the selection", group: "View" },
    { keys: ["home"], does: does.resetView, says: "back to the first view", group: "View" },
    { keys: ["escape"], does: () => pickTool("orbit"), says: "put the tool away", group: "Tools" },
    { keys: ["c"], does: does.toggleCompare, says: "compare two variants", group: "View" },
    { keys: ["l"], does: does.nextLayer, says: "next layer", group: "View" },
    { keys: ["h"], does: () => toggle("histogram"), says: "histogram", group: "View" },
    { keys: ["x"], does: () => toggle("clipping"), says: "clipped pixels", group: "View" },
    { keys: ["k"], does: does.toggleChecker, says: "checker behind transparency", group: "View" },
    { keys: ["g"], does: () => toggle("guides"), says: "guides: action and title safe, thirds", group: "View" },
    { keys: ["?"], does: does.showKeys, says: "this sheet", group: "Work" },
  ];
}
