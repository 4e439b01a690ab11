// A picture that is still noisy is saved at once, or when it is clean, as the person says.

import { question } from "../lib/ask.js";
import { percent } from "../lib/format-text.js";

const CLEAN = 0.05; // of the noise: less of it is seen by nobody who does not look for it
const LOOK_MS = 250;
const KIND = "clean"; // of the message that says what is waited for

export class WhenClean {
  // `page` is the PageState, `editor` the state of the document, `messages` where waiting is said.
  constructor({ page, editor, messages }) {
    Object.assign(this, { page, editor, messages });
  }

  get #isClean() {
    const { header, isDone } = this.page;
    return isDone || this.editor.state.settings.denoise || (header?.noise ?? Infinity) < CLEAN; // what is done gets no cleaner
  }

  // Resolves to whether the picture is to be saved, once it is.
  async isWanted() {
    if (!this.page.header || this.#isClean) return true;
    const { noise } = this.page.header;
    const answer = await question({
      title: `${noise === null ? "Much" : percent(noise)} noise: save now or when clean?`,
      detail: `Clean means less than ${percent(CLEAN)} noise, or the finished picture.`,
      choices: [
        { label: "Save now", value: "now" },
        { label: "When clean", value: "later" },
      ],
    });
    return answer === "later" ? this.#clean() : answer === "now";
  }

  // Waits for that. Another picture is not the one that was wanted.
  async #clean() {
    const { scene, settings, view } = this.editor.state;
    let isCancelled = false;
    const cancel = { label: "Cancel", does: () => (isCancelled = true) };
    this.messages.show(KIND, { title: "The PNG is saved when the picture is clean.", action: cancel, lasting: true });
    for (;;) {
      await new Promise((wake) => {
        setTimeout(wake, LOOK_MS);
      });
      const { state } = this.editor;
      const isOther = state.scene !== scene || state.settings !== settings || state.view !== view;
      if (!isOther && !isCancelled && !this.#isClean) continue;
      this.messages.hide(KIND);
      if (isOther) this.messages.show(KIND, { title: "The picture has changed, so its PNG was not saved." });
      return !isOther && !isCancelled;
    }
  }
}
