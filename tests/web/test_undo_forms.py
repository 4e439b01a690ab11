"""Undo and redo, with every kind of form on the page: each takes a value, gives it back and takes it again."""

from __future__ import annotations

import json
from typing import Any

from playwright.sync_api import WebSocketRoute

from tests.serving import Server
from tests.web.editor import Editor

SCENE: dict[str, Any] = {
    "version": 1,
    "camera": {"position": [0, 1, 4], "target": [0, 1, 0], "vfov": 40},
    "environment": {"type": "constant", "radiance": 0.5, "medium": {"albedo": 0.9, "radius": 5}},
    "textures": {
        "cloud": {"type": "noise"},
        "veins": {
            "type": "ramp",
            "input": {"texture": "cloud"},
            "stops": [{"position": 0, "color": 0.1}, {"position": 1, "color": 0.8}],
        },
        "squares": {"type": "checker", "a": 0.2, "b": 0.8},
    },
    "materials": {
        "ball": {
            "type": "principled",
            "base_color": {"texture": "veins"},
            "roughness": {"texture": "squares"},
            "metallic": 0.2,
        }
    },
    "lights": [{"type": "point", "position": [2, 3, 1], "intensity": 20}],
    "shapes": [{"type": "sphere", "center": [0, 1, 0], "radius": 1, "material": "ball"}],
}
# The first number of each form that is in sight, written, taken back, and written again; but for emission, by which a
# thing becomes a lamp, with another form, and for what is written with a unit.
STEPS = """async () => {
    for (const each of document.querySelectorAll("#panel details")) each.open = true;
    await new Promise((resolve) => setTimeout(resolve, 50));
    const forms = () => [...document.querySelectorAll("#panel .form")].filter((each) => each.checkVisibility());
    const entryOf = (at) => [...(forms()[at]?.querySelectorAll("input.number") ?? [])]
        .filter((each) => each.closest("[data-field]").dataset.field !== "emission" && !/[a-z%]/i.test(each.value))
        .find((each) => each.closest(".form") === forms()[at] && each.checkVisibility());
    const press = (id) => document.getElementById(id).click();
    return forms().map((_, at) => {
        const entry = entryOf(at);
        if (!entry) return null;
        const [before, other] = [entry.value, entry.value === "3" ? "4" : "3"];
        const name = entry.closest("[data-field]").dataset.field;
        entry.value = other;
        entry.dispatchEvent(new Event("change"));
        const read = () => entryOf(at)?.value;
        const found = [read()];
        for (const id of ["undo", "redo", "undo"]) {
            press(id);
            found.push(read());
        }
        return { name, found, expected: [other, before, other, before] };
    }).filter(Boolean);
}"""
# What is opened, and fields of the forms that are there then.
FORMS: list[tuple[str, set[str]]] = [
    (
        "#outline-list [data-thing='/shapes/0'] .title",
        {"metallic", "scale", "position", "a", "priority", "translate"},
    ),
    ("#outline-list [data-thing='/lights/0'] .title", {"power"}),
    ("#outline-list [data-thing='/environment'] .title", {"radiance"}),
    ("#outline-list [data-thing='/camera'] .title", {"vfov", "exposure"}),
    ("#tab-render", {"width", "max_samples", "max_bounces"}),
]


class Mute:
    """A stream that the server hears nothing of any more: what forms do is the page's own, and costs no kernel."""

    def __init__(self, editor: Editor) -> None:
        self.isMute = False
        editor.page.route_web_socket("**/v1/stream**", self._pass_on)

    def _pass_on(self, route: WebSocketRoute) -> None:
        server = route.connect_to_server()
        route.on_message(lambda message: None if self.isMute else server.send(message))


def test_every_form_steps_back_and_forth(blank: Editor, server: Server) -> None:
    editor, page = blank, blank.page
    stream = Mute(editor)
    page.route("**/v1/render?**", lambda route: route.abort())  # small pictures of textures and surroundings
    page.set_viewport_size({"width": 1280, "height": 900})
    editor.open(server.url)
    stream.isMute = True
    page.evaluate("(text) => { navigator.clipboard.readText = async () => text; }", json.dumps(SCENE))
    editor.act("paste-material")
    editor.wait("the scene", lambda: page.locator("#outline-list [data-thing='/lights/0']").count() == 1)
    for opened, names in FORMS:
        page.click(opened)
        steps: list[Any] = []

        def tried(names: set[str] = names, steps: list[Any] = steps) -> bool:
            steps[:] = page.evaluate(STEPS)
            return names <= {each["name"] for each in steps}  # some come on demand

        editor.wait(f"{names} of {opened}", tried)
        for step in steps:
            assert step["found"] == step["expected"], (opened, step["name"])
    assert [each for each in editor.complaints if not each.startswith("error: Failed to load resource")] == []
