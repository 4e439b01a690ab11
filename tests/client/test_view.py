"""The notebook's view as its kernel has it; tests/web/test_notebook.py has it in JupyterLab."""

from __future__ import annotations

import base64
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

import sunbox
from sunbox import live
from sunbox.merge import difference, merged
from tests.serving import ENDLESS, SCENE, Server, wait_until

WIDGET = Path(__file__).parents[2] / "client" / "src" / "sunbox" / "widget"
SIZE = {"width": 32, "height": 24, "max_samples": 64}
MOST_BYTES = 60_000  # of the module


class FrontEnd:
    """What a view sends to its front ends, and what one of them says."""

    def __init__(self, view: Any, name: str = "a") -> None:
        self.view, self.name = view, name
        self.heard: list[tuple[dict[str, Any], Any]] = []
        send = view.send
        view.send = lambda message, buffers=None: (self.heard.append((message, buffers)), send(message, buffers))

    def say(self, kind: str, /, **more: Any) -> None:
        self.view._heard(self.view, {"type": kind, "view": self.name, **more}, [])

    def of(self, kind: str) -> list[dict[str, Any]]:
        return [message for message, _ in self.heard if message["type"] == kind]

    def acknowledge(self) -> None:
        self.say("ack", seq=self.of("frame")[-1]["seq"])


@pytest.fixture
def view(server: Server) -> Iterator[Any]:
    made = sunbox.View(SCENE, server.url, **SIZE)
    yield made
    made.close()


def test_import_takes_no_widgets_along() -> None:
    program = "import sys, sunbox; print([m for m in ('anywidget', 'ipywidgets', 'traitlets') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", program], capture_output=True, text=True).stdout == "[]\n"


def test_what_is_missing_is_named() -> None:
    program = """
import sys
sys.modules["anywidget"] = None
import sunbox
try:
    sunbox.View
except ImportError as error:
    print(error)"""
    assert (
        "./client[notebook]" in subprocess.run([sys.executable, "-c", program], capture_output=True, text=True).stdout
    )


def test_the_module_is_small_and_whole() -> None:
    """A front end takes it as one text, and asks no host for more."""
    assert (WIDGET / "widget.js").stat().st_size < MOST_BYTES
    text = (WIDGET / "widget.js").read_text() + (WIDGET / "widget.css").read_text()
    assert "//" not in text.partition("\n")[2] and not re.search(r"\bimport\b", text.partition("\n")[2])


def test_a_patch_leads_from_one_document_to_another() -> None:
    old = {"a": {"type": "sphere", "radius": 1}, "b": [1, 2], "c": {"d": 1, "e": {"f": 2}}, "g": 1}
    new = {"a": {"type": "box", "min": 0}, "b": [1, 3], "c": {"d": 1, "e": {}}, "h": {"i": 1}}
    patch = difference(old, new)
    assert merged(old, patch) == new and patch["c"] == {"e": {"f": None}} and patch["g"] is None
    assert difference(old, old) is None
    assert merged({"type": "a", "b": 1}, difference({"type": "a", "b": 1}, {"b": 2})) == {"b": 2}


@pytest.mark.notebook
def test_python_changes_the_picture(view: Any) -> None:
    assert view.scene["camera"] == SCENE["camera"] and view.material == "ball" and view.samples >= 1
    view.wait(64)
    before = view.png()
    view.update({"materials": {"ball": {"base_color": "#2040ff"}}})
    assert view.scene["materials"]["ball"]["base_color"] == "#2040ff"
    view.wait(64)
    assert view.samples == 64 and view.noise > 0
    red, _, blue, *_ = Image.open(BytesIO(before)).getpixel((16, 12))
    red_now, _, blue_now, *_ = Image.open(BytesIO(view.png())).getpixel((16, 12))
    assert red > blue and red_now < blue_now


@pytest.mark.notebook
def test_a_scene_replaces_the_other(view: Any) -> None:
    front = FrontEnd(view)
    told = []
    view.observe(lambda change: told.append(list(change.new["materials"])), "scene")
    shapes = [{**shape, "material": "clay"} for shape in SCENE["shapes"]]
    view.scene = {**SCENE, "materials": {"clay": {"type": "diffuse", "albedo": 0.5}}, "shapes": shapes}
    assert told == [["clay"]] and view.material == "clay" and view.scene["shapes"] == shapes
    (shown,) = front.of("scene")
    assert "shapes" not in shown["scene"] and not shown["is_home"], "its front end edits none, and the camera stayed"


@pytest.mark.notebook
def test_what_is_refused_changes_nothing(view: Any) -> None:
    front = FrontEnd(view)
    with pytest.raises(sunbox.Refused) as refused:
        view.update({"camera": {"vfov": 500}})
    assert refused.value.pointer == "/scene/camera/vfov" and view.scene["camera"] == SCENE["camera"]
    front.say("hello")
    front.say("edit", number=1, patch={"materials": {"ball": {"roughness": 7}}})
    wait_until(lambda: front.of("frame") and (front.acknowledge(), front.of("refused"))[1])
    (message,) = front.of("refused")
    assert message["pointer"] == "/materials/ball/roughness" and view.scene["materials"] == SCENE["materials"]
    view.update({"camera": {"vfov": 30}})
    view.wait(64)
    assert view.scene["camera"]["vfov"] == 30 and view.samples == 64


@pytest.mark.notebook
def test_a_hand_changes_the_scene(view: Any) -> None:
    front = FrontEnd(view)
    front.say("hello")
    (begin,) = front.of("begin")
    assert begin["view"] == "a" and "materials" in begin["schema"]["properties"]
    assert {"scenes", "materials", "environments"} == begin["presets"].keys()
    front.say("edit", number=1, patch={"camera": {"position": [1, 0, 4]}})
    assert view.scene["camera"]["position"] == [1, 0, 4] and front.of("taken") == [
        {"type": "taken", "view": "a", "number": 1}
    ]
    assert front.of("scene")[-1]["but"] == "a", "other front ends of the same view follow"
    front.say("preset", kind="materials", name="brass")
    assert view.scene["materials"]["ball"]["type"] == "metal_rough"
    front.say("preset", kind="environments", name="overcast")
    front.say("preset", kind="scenes", name="cornell-empty")
    assert "ball" not in view.scene["materials"] and view.material in view.scene["materials"]
    view.wait(4)
    assert view._live.scene == view.scene, "the server has the same"


@pytest.mark.notebook
def test_frames_wait_for_who_looks(server: Server) -> None:
    """At most two are under way, and who comes back gets the newest."""
    view = sunbox.View(SCENE, server.url, **ENDLESS)
    front = FrontEnd(view)
    front.say("hello")
    wait_until(lambda: len(front.of("frame")) == live.MOST_UNSEEN)
    view.wait(view.samples + 100)
    newest = view.samples
    assert len(front.of("frame")) == live.MOST_UNSEEN and front.of("frame")[-1]["samples"] < newest
    front.acknowledge()
    wait_until(lambda: len(front.of("frame")) > live.MOST_UNSEEN)
    assert front.of("frame")[live.MOST_UNSEEN]["samples"] >= newest
    view.close()
    message, (data,) = next(each for each in reversed(front.heard) if each[0]["type"] == "frame")
    assert message["mime"] == "image/jpeg" and Image.open(BytesIO(data)).size == (32, 24)


@pytest.mark.notebook
def test_a_saved_notebook_has_a_picture(view: Any) -> None:
    data, _ = view._repr_mimebundle_()
    assert "application/vnd.jupyter.widget-view+json" in data
    assert Image.open(BytesIO(base64.b64decode(data["image/png"]))).size == (32, 24)


@pytest.mark.notebook
def test_several_views_are_apart(server: Server, view: Any) -> None:
    other = sunbox.View(SCENE, server.url, **SIZE)
    other.update({"camera": {"vfov": 20}})
    assert view.scene["camera"] == SCENE["camera"] and other.scene["camera"]["vfov"] == 20
    other.close()


@pytest.mark.notebook
def test_a_server_has_room_for_those_who_look(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    """A cell that is run again leaves a view behind, which must not keep its stream until the kernel ends."""
    monkeypatch.setattr(live, "IDLE_S", 0.05)
    view = sunbox.View(SCENE, server.url, **SIZE)
    front = FrontEnd(view)
    front.say("hello")
    wait_until(lambda: front.of("frame") and not view._live._is_asleep)
    time.sleep(0.2)
    assert not view._live._is_asleep, "somebody looks"
    front.say("unseen")
    wait_until(lambda: view._live._is_asleep)
    view.update({"camera": {"vfov": 30}})
    front.say("seen")
    wait_until(lambda: (front.acknowledge(), front.of("frame")[-1]["samples"] == 64)[1])
    assert view._live.scene["camera"]["vfov"] == 30
    view.close()


@pytest.mark.notebook
def test_nobody_answers() -> None:
    with pytest.raises(sunbox.Unreachable):
        sunbox.View(SCENE, "http://127.0.0.1:9")
    with pytest.raises(ValueError, match="is not an address"):
        sunbox.View(SCENE, "somewhere")
