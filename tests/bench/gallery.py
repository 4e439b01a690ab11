"""The README's pictures, rendered again: `python -m tests.bench gallery DATA [NAME ...]`.

DATA has `hdri/studio.exr` (Poly Haven, CC0). Pictures go to web/gallery; their scenes are here or presets.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service import presets

if TYPE_CHECKING:
    from playwright.sync_api import Browser

OUT = Path(__file__).resolve().parents[2] / "web" / "gallery"
STUDIO = {"type": "image", "asset": "hdri/studio.exr", "background": False}


def roughness() -> dict[str, Any]:
    """Nine gold spheres, roughness 0 to 1 from left to right."""
    materials: dict[str, Any] = {"table": {"type": "diffuse", "albedo": 0.25}}
    shapes: list[dict[str, Any]] = [
        {"type": "quad", "origin": [-80, 0, 80], "u": [160, 0, 0], "v": [0, 0, -160], "material": "table"}
    ]
    for k in range(9):
        name = f"roughness-{k / 8}"
        materials[name] = {"type": "disney", "base_color": [1, 0.77, 0.34], "metallic": 1, "roughness": k / 8}
        shapes.append({"type": "sphere", "center": [(k - 4) * 1.06, 0.5, 0], "radius": 0.5, "material": name})
    return {
        "version": 1,
        "camera": {"position": [0, 1.3, 14], "target": [0, 0.45, 0], "vfov": 11.5},
        "environment": {**STUDIO, "rotation": 200, "background": True},
        "materials": materials,
        "shapes": shapes,
    }


def materials() -> dict[str, Any]:
    """Six of the material presets under the sky of a low sun."""
    names = ("glass", "gold", "car-paint", "velvet", "porcelain", "amber")
    floor = {"type": "quad", "origin": [-40, 0, 40], "u": [80, 0, 0], "v": [0, 0, -80], "material": "floor"}
    spheres = [
        {
            "type": "sphere",
            "center": [(k % 3 - 1) * 1.3 + (0.0 if k > 2 else 0.65), 0.5, k // 3 * 1.5],
            "radius": 0.5,
            "material": name,
        }
        for k, name in enumerate(names)
    ]
    return {
        "version": 1,
        "camera": {"position": [0.6, 2.6, 6.6], "target": [0, 0.5, 0.55], "vfov": 26},
        "environment": {**presets.get("environments", "low-sun"), "rotation": 250, "scale": 0.1},
        "materials": {"floor": {"type": "diffuse", "albedo": 0.4}}
        | {name: presets.get("materials", name) for name in names},
        "shapes": [*spheres, floor],
    }


def preset(name: str) -> Callable[[], dict[str, Any]]:
    return lambda: presets.get("scenes", name)


PICTURES: dict[str, tuple[Callable[[], dict[str, Any]], tuple[int, int, int], float]] = {
    # scene, (width, height, samples), exposure
    "roughness": (roughness, (1200, 280, 512), -0.5),
    "materials": (materials, (800, 440, 300), 0.0),
    "cornell": (preset("cornell-boxes"), (512, 512, 1024), 0.0),
    "shader-ball": (preset("shader-ball"), (800, 600, 512), 0.0),
}


# Of the editor: the window, light or dark, and what is done before the picture is taken.
STATES: dict[str, tuple[tuple[int, int], str, list[tuple[str, str, str]]]] = {
    "editor": ((1400, 900), "dark", []),
    "editor-compare": (
        (1280, 800), "dark",
        [("key", "c", ""), ("select", "#comparison [aria-label^=Turn]", "blinn_phong")],
    ),
    "editor-lobe": (
        (1280, 800), "dark",
        [("click", "#library [data-value=velvet]", ""), ("key", "b", ""), ("key", "c", ""),
         ("select", "#comparison [aria-label^=Turn]", "disney"), ("click", "#lobe [data-value=polar]", ""),
         ("click", "#lobe >> text=By lobe", "")],
    ),
    "editor-scene": ((1280, 800), "light", [
        ("click", "#outline-list [data-thing='/environment']", ""), ("click", "#view", ""),
        ("click", "#show-histogram", ""), ("key", "Escape", ""), ("key", "7", ""),
    ]),
    "editor-render": (
        (1280, 800), "light",
        [("click", "#tab-render", ""), ("click", "#view", ""), ("select", "#layer", "normal"),
         ("key", "Escape", "")],
    ),
    "editor-phone": ((390, 844), "dark", [("click", "#library [data-value=copper]", "")]),
    "editor-lost": (  # the last: it ends the server
        (1280, 800), "dark",
        [("fill", "#panel [data-field=roughness] input.number", "7"), ("lose", "", "")],
    ),
}  # fmt: skip
FIRST_SCENE = ("editor", "editor-phone")
LOST = "text=The connection to the server was lost"


def photograph_editor(sunbox: Path, names: list[str], port: int = 8765, wait_s: float = 18) -> None:
    """The editor's states, converged, in a headless browser (a development dependency)."""
    from playwright.sync_api import sync_playwright

    flags = ["--no-sandbox", "--disable-dev-shm-usage"]
    with subprocess.Popen([sunbox, "serve", "--port", str(port)]) as server, sync_playwright() as playwright:
        try:
            time.sleep(3)
            browser = playwright.chromium.launch(
                executable_path=shutil.which("chromium") or shutil.which("chromium-headless-shell"), args=flags
            )
            _photograph(browser, server, names, port, wait_s)
        finally:
            server.terminate()


def _photograph(
    browser: Browser, server: subprocess.Popen[bytes], names: list[str], port: int, wait_s: float
) -> None:
    for name in names:
        (width, height), scheme, acts = STATES[name]
        page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=scheme)  # type: ignore[arg-type]
        page.add_init_script("localStorage['sunbox.ui'] ??= JSON.stringify({ hint: false })")  # read by now
        # The first scene, where all of the page is shown; a quicker one, where a part of it is.
        page.goto(f"http://127.0.0.1:{port}/{'' if name in FIRST_SCENE else '#scene=sphere-on-floor'}")
        page.wait_for_selector("#stage.live")
        for act, what, value in acts:
            if act == "key":
                page.keyboard.press(what)
            elif act == "click":
                page.click(what)
            elif act == "fill":
                page.fill(what, value)
                page.press(what, "Enter")
            elif act == "lose":
                page.wait_for_timeout(1000 * wait_s)
                server.terminate()
                page.wait_for_selector(LOST)
                page.locator(":focus").evaluate("(field) => field.scrollIntoView({ block: 'center' })")
                wait_s = 0.5  # before it is tried again
            else:
                page.select_option(what, value)
        page.wait_for_timeout(1000 * wait_s * (4 if name in FIRST_SCENE else 1))
        page.screenshot(path=OUT / f"{name}.png")
        page.close()
    browser.close()


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("data", type=Path)
    parser.add_argument("names", nargs="*", default=[*PICTURES, *STATES], metavar="NAME")


def run(wanted: argparse.Namespace) -> int:
    OUT.mkdir(exist_ok=True)
    sunbox = Path(sys.executable).with_name("sunbox")
    states = [name for name in STATES if name in wanted.names]
    if states:
        photograph_editor(sunbox, states)
    for name in wanted.names:
        if name in STATES:
            continue
        document, (width, height, samples), exposure = PICTURES[name]
        with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
            json.dump(document(), file)
            file.flush()
            command: list[str | Path] = [
                sunbox,
                "render",
                file.name,
                "-o",
                OUT / f"{name}.png",
                "--asset-root",
                wanted.data,
            ]
            command += ["--exposure", str(exposure)]
            command += ["--spp", str(samples), "--set", f"width={width}", "--set", f"height={height}"]
            subprocess.run(command, check=True)
    return 0
