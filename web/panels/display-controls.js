// The controls of the interface's state: tabs and drawers, the layer, the overlays of the picture.

import { element } from "../lib/dom.js";
import { inWords } from "../lib/format-text.js";
import { watchMenu } from "../lib/menu.js";
import { watchTabs } from "../lib/tabs.js";

const SWITCHES = {
  denoised: "Denoised while it is noisy",
  histogram: "Histogram",
  clipping: "Clipped pixels",
  checker: "Checker behind transparency",
  guides: "Guides",
  target: "What the camera looks at",
};

export class DisplayControls {
  // `page` is the PageState, `does` the commands.
  constructor({ find, page, ui, does }) {
    Object.assign(this, { find, page, ui });
    this.showTab = watchTabs(find("tabs"), ui.state.tab, (tab) => ui.set({ tab }));
    this.showDrawer = watchTabs(find("drawers"), ui.state.drawer, (drawer) => ui.set({ drawer }));
    watchMenu(find("view"), find("view-menu"));
    find("dismiss-hint").addEventListener("click", () => ui.set({ hint: false }));
    this.layer = find("layer");
    this.layer.append(...page.layers.map((each) => element("option", { value: each }, inWords(each))));
    this.layer.addEventListener("change", () => ui.set({ layer: this.layer.value }));
    find("overlays").append(
      ...Object.entries(SWITCHES).map(([member, title]) =>
        element(
          "label",
          {},
          element("input", {
            type: "checkbox",
            class: "toggle",
            id: `show-${member}`,
            onchange: () => (member === "checker" ? does.toggleChecker() : does.toggle(member)),
          }),
          title,
        ),
      ),
    );
  }

  show() {
    const { tab, drawer, theme, layer, ...members } = this.ui.state;
    this.showTab(tab);
    this.showDrawer(drawer);
    this.layer.value = layer;
    this.find("hint").hidden = !members.hint;
    const isOn = { ...members, checker: this.page.isCheckered };
    for (const member of Object.keys(SWITCHES)) this.find(`show-${member}`).checked = isOn[member];
    if (theme) document.documentElement.dataset.theme = theme;
  }
}
