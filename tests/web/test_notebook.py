"""`sunbox.View` in a real JupyterLab: a hand on the picture and on a slider, and what Python has of that."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Locator, Page

from tests.serving import Server
from tests.web.conftest import free_port
from tests.web.editor import PATIENCE_S

pytestmark = pytest.mark.notebook

EXAMPLE = Path(__file__).parents[2] / "client" / "examples" / "view.ipynb"
BEGIN = """import sunbox
scene = sunbox.Client().preset("scenes", "sphere-on-floor")
seen = []
view = sunbox.View(scene, width=160, height=120)
view.observe(lambda change: seen.append(change.new), "scene")
view"""
TWICE = """other = sunbox.View(scene, width=80, height=60)
other"""
TOLD = """import json
print(json.dumps({"scene": {**view.scene, "shapes": None}, "seen": len(seen), "other": other.scene["camera"]}))"""
CHANGED = 'view.update({"materials": {"Red paint": {"base_color": [0.02, 0.1, 0.9], "roughness": 0.2}}})'
CELLS = [BEGIN, TWICE, TOLD, CHANGED, TOLD]
SETTINGS = {  # nothing is asked of other hosts
    "notification": {"fetchNews": "false", "checkForUpdates": False},
}


def environment(folder: Path, server: Server) -> dict[str, str]:
    """Jupyter's folders away from the user's own."""
    names = ("JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR", "IPYTHONDIR")
    places = {name: str(folder / name.lower()) for name in names}
    return os.environ | places | {"SUNBOX_URL": server.url, "JUPYTER_PLATFORM_DIRS": "1"}


@pytest.fixture(scope="module")
def lab(server: Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a JupyterLab with the notebook."""
    folder, port = tmp_path_factory.mktemp("lab"), free_port()
    settings = folder / "jupyter_config_dir" / "lab" / "user-settings" / "@jupyterlab" / "apputils-extension"
    settings.mkdir(parents=True)
    for name, document in SETTINGS.items():
        (settings / f"{name}.jupyterlab-settings").write_text(json.dumps(document))
    work = folder / "work"
    work.mkdir()
    (work / "view.ipynb").write_text(notebook(CELLS))
    command = [sys.executable, "-m", "jupyterlab", "--no-browser", "--port", str(port), "--allow-root"]
    command += ["--IdentityProvider.token=", "--ServerApp.password="]
    with (folder / "log").open("wb") as log:
        process = subprocess.Popen(command, cwd=work, env=environment(folder, server), stdout=log, stderr=log)
    try:
        until = time.monotonic() + PATIENCE_S
        while not answers(f"http://127.0.0.1:{port}/api"):
            assert process.poll() is None and time.monotonic() < until, (folder / "log").read_text()
            time.sleep(0.1)
        yield f"http://127.0.0.1:{port}"
    finally:
        process.terminate()
        process.wait(PATIENCE_S)


def answers(url: str) -> bool:
    try:
        with urllib.request.urlopen(url, timeout=5) as answer:
            return bool(answer.status == 200)
    except OSError:
        return False


def notebook(cells: list[str]) -> str:
    common = {"cell_type": "code", "execution_count": None, "metadata": {}, "outputs": []}
    made = [common | {"id": f"cell-{i}", "source": source} for i, source in enumerate(cells)]
    kernel = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    return json.dumps({"cells": made, "metadata": kernel, "nbformat": 4, "nbformat_minor": 5})


class Notebook:
    """The page, whose cells are run one after the other."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.hosts: set[str] = set()
        self.complaints: list[str] = []
        page.set_default_timeout(PATIENCE_S * 1000)
        page.on("request", lambda request: self.hosts.add(request.url.split("/")[2].split(":")[0]))
        page.on("pageerror", lambda error: self.complaints.append(str(error)))

    def cell(self, place: int) -> Locator:
        return self.page.locator(".jp-CodeCell").nth(place)

    def run(self, place: int) -> None:
        before = self.prompt(place)

        def begun() -> bool:
            """Until a kernel has started, JupyterLab drops what it is to run."""
            self.cell(place).locator(".cm-content").click()
            self.page.keyboard.press("Control+Enter")
            self.page.wait_for_timeout(300)
            return self.prompt(place) != before

        self.wait(f"the begin of cell {place}", begun)
        self.wait(f"the end of cell {place}", lambda: self.prompt(place).isdecimal())

    def prompt(self, place: int) -> str:
        return self.cell(place).locator(".jp-InputPrompt").inner_text().strip("[]: ")

    def told(self, place: int) -> Any:
        """What the cell prints, run now."""
        self.run(place)
        return json.loads(self.cell(place).locator(".jp-OutputArea-output").inner_text())

    def wait(self, what: str, reached: Callable[[], object]) -> None:
        until = time.monotonic() + PATIENCE_S
        while not reached():
            assert time.monotonic() < until, f"waited in vain for {what}; the page says {self.complaints}"
            self.page.wait_for_timeout(50)

    def view(self, place: int) -> Locator:
        return self.cell(place).locator(".sunbox-view")

    def pixels(self, place: int) -> list[float]:
        """The canvas in 8 x 8 averages: too coarse for noise to count."""
        values: list[float] = (
            self.view(place)
            .locator("canvas")
            .evaluate(
                """(canvas) => {
                const small = new OffscreenCanvas(8, 8).getContext("2d");
                small.imageSmoothingQuality = "high";
                small.drawImage(canvas, 0, 0, 8, 8);
                return [...small.getImageData(0, 0, 8, 8).data].filter((_, i) => i % 4 < 3);
            }"""
            )
        )
        return values

    def differs(self, place: int, before: list[float]) -> bool:
        apart = sorted((abs(a - b) for a, b in zip(before, self.pixels(place), strict=True)), reverse=True)
        return sum(apart[:19]) / 19 > 6

    def samples(self, place: int) -> int:
        return int("".join(filter(str.isdigit, self.view(place).locator(".samples").inner_text().split(",")[0])) or 0)


@pytest.fixture(scope="module")
def shown(lab: str, browser: Browser) -> Iterator[Notebook]:
    """The notebook with both views on the page."""
    page = browser.new_page(viewport={"width": 1280, "height": 1400})
    book = Notebook(page)
    page.goto(f"{lab}/lab/tree/view.ipynb")
    page.wait_for_selector(".jp-Notebook .jp-CodeCell")
    for place in (0, 1):
        book.run(place)
        book.view(place).locator(".field").first.wait_for()
        book.wait("a picture", lambda place=place: book.samples(place) >= 4)
    yield book
    page.close()


def test_a_drag_orbits_and_python_sees_it(shown: Notebook) -> None:
    before, first = shown.pixels(0), shown.told(2)
    shown.view(0).scroll_into_view_if_needed()
    box = shown.view(0).locator("canvas").bounding_box()
    assert box is not None
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    mouse = shown.page.mouse
    mouse.move(*middle)
    mouse.down()
    mouse.move(middle[0] + box["width"] / 3, middle[1] + 30, steps=8)
    mouse.up()
    shown.wait("other pixels", lambda: shown.differs(0, before))
    told = shown.told(2)
    assert told["scene"]["camera"]["position"] != first["scene"]["camera"]["position"]
    assert told["scene"]["camera"]["target"] == first["scene"]["camera"]["target"]
    assert told["seen"] > first["seen"] and told["other"] == first["other"]


def test_a_slider_changes_the_material(shown: Notebook) -> None:
    slider = shown.view(0).get_by_role("slider", name="Roughness", exact=True)
    before = shown.told(2)["scene"]["materials"]["Red paint"]["roughness"]
    slider.focus()
    for _ in range(20):
        shown.page.keyboard.press("ArrowRight")
    value = float(slider.input_value())
    shown.wait("the new value", lambda: shown.told(2)["scene"]["materials"]["Red paint"]["roughness"] == value)
    assert value > before


def test_a_number_is_written_and_what_is_refused_is_said_there(shown: Notebook) -> None:
    number = shown.view(0).get_by_label("Roughness, number", exact=True)
    trouble = shown.view(0).locator(".field .trouble:visible")
    number.fill("0.35")
    number.press("Enter")
    shown.wait("the number", lambda: shown.told(2)["scene"]["materials"]["Red paint"]["roughness"] == 0.35)
    number.fill("7")
    number.press("Enter")
    trouble.wait_for()
    assert "not 7" in trouble.inner_text()
    assert shown.told(2)["scene"]["materials"]["Red paint"]["roughness"] == 0.35
    number.fill("0.5")
    number.press("Enter")
    shown.wait("the number", lambda: shown.told(2)["scene"]["materials"]["Red paint"]["roughness"] == 0.5)
    assert trouble.count() == 0


def test_python_changes_the_picture_and_the_form(shown: Notebook) -> None:
    before = shown.pixels(0)
    shown.run(3)
    shown.wait("other pixels", lambda: shown.differs(0, before))
    slider = shown.view(0).get_by_role("slider", name="Roughness", exact=True)
    shown.wait("the slider", lambda: float(slider.input_value()) == 0.2)


def test_a_menu_takes_a_material(shown: Notebook) -> None:
    before = shown.pixels(0)
    shown.view(0).get_by_label("Library").select_option("brass")
    shown.wait("other pixels", lambda: shown.differs(0, before))
    material = shown.told(4)["scene"]["materials"]["Red paint"]
    assert material["metallic"] == 1 and shown.view(0).get_by_label("Library").input_value() == ""


def test_the_wheel_scrolls_until_the_picture_is_in_hand(shown: Notebook) -> None:
    canvas = shown.view(1).locator("canvas")
    canvas.scroll_into_view_if_needed()
    shown.view(0).locator("select").first.focus()
    before = shown.told(2)["other"]
    canvas.hover()
    shown.page.mouse.wheel(0, -200)
    shown.page.wait_for_timeout(300)
    assert shown.told(2)["other"] == before
    canvas.scroll_into_view_if_needed()
    canvas.click()
    shown.page.mouse.wheel(0, -200)
    shown.wait("a camera that is nearer", lambda: shown.told(2)["other"] != before)


def test_nothing_comes_from_other_hosts(shown: Notebook) -> None:
    assert shown.hosts <= {"127.0.0.1", ""} and shown.complaints == []


def test_the_example_runs(server: Server, tmp_path: Path) -> None:
    """And what is saved of it has pictures beside its widget."""
    made = tmp_path / "made.ipynb"
    program = f"""
import nbformat, nbclient
book = nbformat.read({str(EXAMPLE)!r}, 4)
nbclient.NotebookClient(book, timeout={PATIENCE_S}).execute()
nbformat.write(book, {str(made)!r})"""
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        env=environment(tmp_path, server),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    cells = [cell for cell in json.loads(made.read_text())["cells"] if cell["cell_type"] == "code"]
    shown, _, refused, edits, picture = (cell["outputs"][-1] for cell in cells)
    assert {"application/vnd.jupyter.widget-view+json", "image/png"} <= shown["data"].keys()
    assert "/scene/materials/Red paint/roughness" in "".join(refused["text"])
    assert "".join(edits["data"]["text/plain"]) == "1" and "image/png" in picture["data"]
    assert all(cell["outputs"] == [] for cell in json.loads(EXAMPLE.read_text())["cells"] if "outputs" in cell)
