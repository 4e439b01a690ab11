// Work that makes room for another scene can be taken back: a message offers that.

export function offerUndo(editor, messages, titleOf) {
  let before = editor.state;
  editor.subscribe((state) => {
    const left = before;
    before = state;
    // What undo and redo bring has its way back; a link or the last visit's work replaces nothing.
    const isReplaced = state.home !== left.home && left.scene !== left.home && !editor.canRedo && editor.canUndo;
    if (!isReplaced) return;
    messages.show("replaced", {
      title: `${titleOf(state.chosen) || "Another scene"} is open.`,
      detail: "What you changed in the last scene is not saved.",
      action: {
        label: "Undo",
        does: () => {
          messages.hide("replaced");
          if (editor.state.home === state.home) editor.undo();
        },
      },
    });
  });
}
