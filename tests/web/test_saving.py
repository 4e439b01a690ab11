"""What is kept and what leaves the page: files, links, commands, autosave, names on the server, imports."""

from __future__ import annotations

import io
import json
import shlex
import subprocess
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image

from service.formats.images import read_metadata
from tests.serving import Server
from tests.web.conftest import WINDOW
from tests.web.editing import TRIANGLE, document, finish, overlay
from tests.web.editor import Editor


def read_exr(path: Path) -> tuple[list[str], np.ndarray]:
    image = oiio.ImageInput.open(str(path))
    assert image is not None
    pixels = image.read_image("float")
    return list(image.spec().channelnames), np.asarray(pixels)


def save_material(editor: Editor, name: str) -> None:
    editor.act("save-material")
    editor.page.fill("dialog[open] .entry", name)
    editor.page.keyboard.press("Enter")


def test_files_hold_the_picture(editor: Editor, tmp_path: Path) -> None:
    finish(editor, 6)
    flat = np.asarray(Image.open(io.BytesIO(editor.shot("#download"))).convert("RGB"), int)
    deep = editor.shot("#download-16")
    assert deep[24] == 16
    assert np.abs(np.asarray(Image.open(io.BytesIO(deep)).convert("RGB"), int) - flat).max() <= 1
    path = tmp_path / "layers.exr"
    path.write_bytes(editor.shot("#download-exr"))
    names, pixels = read_exr(path)
    assert {"R", "A", "albedo.R", "normal.X", "depth.Z", "variance.G"} <= set(names)
    assert pixels.shape[:2] == flat.shape[:2]
    depth = pixels[..., names.index("depth.Z")]
    assert 3.5 < depth[depth > 0].min() < 5
    height, width = depth.shape
    middle = pixels[height // 2, width // 2]
    assert middle[names.index("normal.Z")] > 0.9 and middle[names.index("R")] > 2 * middle[names.index("B")]

    # The command makes the same picture, byte for byte.
    editor.page.click("#export")
    editor.page.click("#copy-curl")
    editor.wait("the command", lambda: editor.page.input_value(".command").startswith("curl"))
    command = shlex.split(editor.page.input_value(".command"))
    command[command.index("-o") + 1] = str(tmp_path / "again.png")
    subprocess.run(command, check=True, timeout=60)
    again = np.asarray(Image.open(tmp_path / "again.png").convert("RGB"), int)
    assert np.array_equal(again, flat)


def test_a_picture_carries_its_document_and_brings_it_back(editor: Editor, server: Server) -> None:
    editor.page.click("#library [data-value=gold]")
    finish(editor, 5)
    gold = editor.settled()
    own = editor.shot("#download")
    made = read_metadata(own)
    assert made is not None and made["samples"] == 5 and made["view"]["bits"] == 8
    answer = server.http.post("/v1/render", json={key: made[key] for key in ("scene", "settings")})
    assert read_metadata(answer.content) == made, "the same metadata as the server's"
    with Image.open(io.BytesIO(own)) as mine, Image.open(io.BytesIO(answer.content)) as theirs:
        assert mine.tobytes() == theirs.tobytes()
    layers = editor.shot("#download-exr")
    assert (read_metadata(layers) or {})["view"]["aov"] == "all"

    for name, data in {"mine.png": own, "curl.png": answer.content, "layers.exr": layers}.items():
        editor.tab("material")
        editor.page.click("#library [data-value=chalk]")
        editor.wait_for_change(gold)
        editor.drop("#stage", {name: data})
        editor.wait("gold", lambda: not editor.differs(gold, 8))
        assert editor.page.is_hidden("[data-field=base_color] .texture")
        editor.wait("its samples", lambda: editor.text("#state") == "Done" and editor.samples() == 5)
    plain = io.BytesIO()
    Image.new("RGB", (8, 8), (0, 200, 0)).save(plain, "PNG")
    editor.drop("#stage", {"plain.png": plain.getvalue()})
    editor.wait("a texture", lambda: editor.page.is_visible("[data-field=base_color] .texture"))


def test_a_link_and_the_browser_bring_the_view_back(editor: Editor) -> None:
    before = editor.settled()
    editor.page.click("#library [data-value=gold]")
    editor.page.keyboard.press("ArrowLeft")
    editor.page.keyboard.press("ArrowLeft")
    editor.wait_for_change(before)
    editor.page.click("#share")
    editor.wait("the link", lambda: "#v=" in editor.page.input_value(".command"))
    link = editor.page.input_value(".command")

    stranger = Editor(editor.page.context.browser.new_page(viewport=WINDOW))  # type: ignore[union-attr]
    stranger.page.goto(link)
    stranger.wait("a picture", lambda: stranger.samples() >= 4)
    stranger.settled()
    # Beside what the editor shows by then: at first it may be the picture of the first key alone.
    stranger.wait("the same view", lambda: not stranger.differs(editor.settled(), 8))
    stranger.page.close()
    shown = editor.settled()

    editor.page.wait_for_timeout(800)
    editor.page.reload()
    editor.wait("the work", lambda: "last work" in editor.text("#messages"))
    editor.settled()
    assert not editor.differs(shown, 8)
    editor.page.click("text=Start afresh")
    editor.wait("the first scene", lambda: editor.text("#scene-title") == "Shader ball")


def test_snapshots_and_names(editor: Editor, server: Server) -> None:
    before = editor.settled()
    editor.tab("save")
    editor.page.click("text=Take a snapshot")
    editor.wait("a snapshot", lambda: editor.page.locator(".snapshot img").count() == 1)
    save_material(editor, "my red")
    mine = editor.page.locator("#library [role=option][aria-label='my red']")
    editor.wait("its name", lambda: mine.count() == 1)
    assert server.http.get("/v1/documents/materials/my%20red").json()["type"] == "principled"
    editor.page.click("#library [data-value=gold]")
    editor.wait_for_change(before)
    editor.page.click("#kinds [data-kind=saved]")
    mine.click()
    editor.wait("red again", lambda: not editor.differs(before, 8))
    editor.page.click("#forget-saved")
    asked = "text=Delete “my red”?"  # it is everybody's, and gone for good
    editor.wait("a question", lambda: editor.page.is_visible(asked))
    editor.page.keyboard.press("Escape")
    assert mine.count() == 1
    mine.focus()
    editor.page.keyboard.press("Delete")
    editor.page.click("dialog[open] button:text-is('Delete')")
    editor.wait("its end", lambda: mine.count() == 0)
    editor.page.keyboard.press("Control+z")
    editor.wait_for_change(before)
    editor.tab("save")
    editor.page.click(".snapshot .open")
    editor.wait("the snapshot's view", lambda: not editor.differs(before, 8))


def test_any_name_can_be_saved_and_is_not_lost_by_accident(editor: Editor, server: Server) -> None:
    page = editor.page
    page.click("#kinds [data-kind=saved]")
    names = ["My first scene / \u00e4", "..", "50% grey?#1", "m" * 64]
    for name in names:
        save_material(editor, name)
        opener = page.locator("#library [role=option]", has_text=name)
        editor.wait("the name", lambda opener=opener: opener.count() == 1)
        assert editor.text("#messages") == ""
        assert opener.get_attribute("aria-label") == name
    assert {each["title"] for each in server.http.get("/v1/documents/materials").json()} == set(names)
    for name in names[:2]:
        page.locator("#library [role=option]", has_text=name).click()
        editor.wait("the material", lambda: editor.text("#messages") == "")
    # The same of scenes, in their menu.
    editor.tab("save")
    page.fill("#page-save .entry", names[3])
    page.keyboard.press("Enter")
    cross = page.locator(f"[aria-label='Delete {names[3]}']")
    editor.wait("the scene's name", lambda: cross.count() == 1)
    assert editor.text("#scene-title") == names[3]
    assert page.evaluate("(p => p.scrollWidth - p.clientWidth)(document.getElementById('page-save'))") == 0
    menu, box = page.locator("#page-save").bounding_box(), cross.bounding_box()
    assert menu and box and box["x"] + box["width"] <= menu["x"] + menu["width"], "a long name leaves it room"
    page.keyboard.press("Escape")

    before = server.http.get("/v1/documents/materials/50%25%20grey%3F%231").json()
    page.select_option("#model", "diffuse")
    for answer in ("Cancel", "Replace"):
        save_material(editor, names[2])
        page.click(f"dialog[open] button:text-is('{answer}')")
        editor.wait("the answer", lambda: page.locator("dialog[open]").count() == 0)
        if answer == "Cancel":
            assert server.http.get("/v1/documents/materials/50%25%20grey%3F%231").json() == before
    editor.wait(
        "the other",
        lambda: server.http.get("/v1/documents/materials/50%25%20grey%3F%231").json()["type"] == "diffuse",
    )


def test_two_tabs_keep_two_works(editor: Editor, server: Server) -> None:
    context = editor.page.context

    def kept(tab: Editor) -> object:
        return tab.page.evaluate(
            "JSON.parse(localStorage['sunbox.work ' + sessionStorage['sunbox.tab']] ?? 'null')"
            "?.scene.materials['Red paint'].type"
        )

    def work(tab: Editor, model: str) -> None:
        tab.page.select_option("#model", model)
        tab.wait("its work to be kept", lambda: kept(tab) == model)

    work(editor, "diffuse")
    second = Editor(context.new_page())
    second.open(server.url, "")
    assert second.page.input_value("#model") == "diffuse", "a new tab begins with the last work"
    work(second, "disney")
    editor.page.reload()
    editor.wait("the first work", lambda: "last work" in editor.text("#messages"))
    assert editor.page.input_value("#model") == "diffuse"
    second.page.reload()
    second.wait("the second work", lambda: "last work" in second.text("#messages"))
    assert second.page.input_value("#model") == "disney"
    # A duplicated tab comes with the name of the first.
    third = Editor(context.new_page())
    name = editor.page.evaluate("sessionStorage['sunbox.tab']")
    third.page.add_init_script(f"sessionStorage['sunbox.tab'] ??= '{name}'")
    third.open(server.url, "")
    assert third.page.evaluate("sessionStorage['sunbox.tab']") != name
    assert third.page.input_value("#model") == "diffuse"


def test_json_leaves_and_comes_back(editor: Editor) -> None:
    before = editor.settled()
    scene = editor.shot("#download-scene")
    document = json.loads(scene)
    document["materials"]["Red paint"] = {"type": "diffuse", "albedo": [0, 0.6, 0]}
    editor.drop("#stage", {"green.json": json.dumps(document).encode()})
    editor.page.click("dialog[open] [value=open]")
    editor.wait_for_change(before)
    editor.drop("#stage", {"old.json": scene})
    editor.page.click("dialog[open] [value=open]")
    editor.wait("the old scene", lambda: not editor.differs(before, 8))
    editor.drop("#stage", {"note.txt": b"hello"})
    editor.wait("a refusal", lambda: "note.txt could not be used" in editor.text("#messages"))
    assert "Sunbox can open .gltf, .glb, " in editor.text("#messages"), "what would be right is said"


def test_dropped_files_find_their_places(editor: Editor) -> None:
    editor.settled()
    things = editor.page.locator("#outline-list [role=treeitem]")
    editor.drop("#stage", {"triangle.obj": TRIANGLE})
    editor.tab("scene")
    editor.wait("the mesh", lambda: things.count() == 5 and editor.text("#thing-title") == "triangle")
    editor.settled()
    editor.page.evaluate("document.activeElement.blur()")
    editor.page.keyboard.press("Delete")
    editor.wait("its end", lambda: things.count() == 4)
    editor.page.keyboard.press("Home")

    red = io.BytesIO()
    Image.new("RGB", (8, 8), (0, 200, 0)).save(red, "PNG")
    editor.page.click("#outline-list [data-thing='/shapes/0']")
    editor.tab("material")
    before = editor.settled()
    editor.drop("#material-form [data-field=base_color]", {"green.png": red.getvalue()})
    editor.wait("the texture", lambda: "green" in editor.text("[data-field=base_color] .texture"))
    editor.wait_for_change(before, 8)
    height, width = overlay(editor, "picture").shape[:2]
    editor.settled()
    r, g, _, _ = overlay(editor, "picture")[height * 6 // 10, width // 2]
    assert g > r, "the ball is green"
    editor.page.click("[data-field=base_color] .texture .forget")
    editor.wait("no texture", lambda: editor.page.is_hidden("[data-field=base_color] .texture"))
    editor.drop("#stage", {"broken.glb": b"glTF nonsense"})
    editor.wait("a refusal", lambda: "broken.glb could not be used" in editor.text("#messages"))
    assert editor.page.locator("dialog[open]").count() == 0, "nothing is asked about what cannot be read"


def test_a_dropped_mesh_is_in_sight(editor: Editor) -> None:
    """Of a few centimetres, and inside of the ball where its file has it."""
    before = editor.settled()
    tiny = b"v -.02 .98 0\nv .02 .98 0\nv 0 1.02 0\nv 0 1 .03\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 3 1 4\nf 1 2 9\n"
    editor.drop("#stage", {"tiny.obj": tiny})
    editor.tab("scene")
    editor.wait("the mesh", lambda: editor.text("#thing-title") == "tiny")
    told = editor.told()
    assert "tiny.obj: good to know." in told and "100 times its size" in told and "1 face" in told, told
    shape = document(editor)["shapes"][-1]
    assert shape["transform"]["scale"] == 100 and shape["transform"]["translate"][1] == pytest.approx(-98), (
        "on the floor"
    )
    editor.settled()
    editor.page.click("#thing-acts >> text=Frame")
    editor.page.click("#outline-list [data-thing='/camera']")
    editor.settled()
    editor.click_until("what is in the middle", lambda: editor.text("#thing-title") == "tiny")
    editor.page.keyboard.press("Control+z")
    editor.page.keyboard.press("Control+z")
    editor.wait("all as before", lambda: not editor.differs(before, 6))


def test_things_are_added_moved_and_removed(editor: Editor) -> None:
    before = editor.settled()
    editor.tab("scene")
    editor.page.select_option("#add", label="Point light")
    editor.wait_for_change(before)
    assert editor.text("#thing-title") == "Point light"
    editor.page.click("#thing-acts >> text=Delete")
    editor.wait("the light's end", lambda: not editor.differs(before, 8))
    editor.page.click("#outline-list [data-thing='/shapes/0']")
    entry = editor.page.locator("#thing-form [data-field=translate] input >> nth=0")
    entry.fill("0.8")
    entry.press("Enter")
    editor.wait_for_change(before)
    editor.page.keyboard.press("Control+z")
    editor.wait("the ball's place", lambda: not editor.differs(before, 8))


def test_the_last_thing_cannot_be_deleted(editor: Editor) -> None:
    """A scene keeps a shape: also the one that moved up into the place of another of its kind."""
    acts, things = editor.page.locator("#thing-acts"), editor.page.locator("#outline-list [role=treeitem]")
    editor.tab("scene")
    editor.page.click("#outline-list [data-thing='/shapes/1']")
    acts.get_by_text("Delete").click()
    assert editor.text("#thing-title") == "Sphere" and acts.inner_text().split() == ["Frame", "Duplicate"]
    acts.get_by_text("Duplicate").click()
    editor.page.click("#outline-list [data-thing='/shapes/0']")
    acts.get_by_text("Delete").click()
    assert things.count() == 3 and acts.inner_text().split() == ["Frame", "Duplicate"]


def test_a_picture_is_shared_over_a_strip_that_says_what_it_is(editor: Editor) -> None:
    editor.settled()
    editor.page.click("#export")
    image = Image.open(io.BytesIO(editor.shot("#share-picture"))).convert("RGB")
    tall, wide = editor.page.evaluate("[picture.height, picture.width]")
    below = image.width * tall / wide
    assert image.width >= 1080 and image.height == pytest.approx(below + 0.13 * image.width, abs=2)
    strip = np.asarray(image.crop((0, int(below) + 2, image.width, image.height)), float).mean(axis=2)
    rows = (strip > 120).sum(axis=1) > 8
    assert 2 <= (np.diff(rows.astype(int)) == 1).sum() <= 4, "lines of light letters"
    assert np.median(strip) < 40, "on a dark ground"
    assert "The link" in editor.text("#messages")
