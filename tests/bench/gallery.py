"""The README's pictures, rendered again and denoised: `python -m tests.bench gallery [NAME ...]`.

They go to web/gallery; their scenes are here or presets.
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

from service.document import presets
from tests.bench import thumbnail_shapes as shapes
from tests.bench import thumbnail_stages as stages

if TYPE_CHECKING:
    from playwright.sync_api import Browser

OUT = Path(__file__).resolve().parents[2] / "web" / "gallery"
ROWS = (  # of `materials`: what each is on, where that stands (x, z), and its radius
    ("jade", "shell", (-2.1, -0.5), 0.52),
    ("gold", "ball", (-0.72, -0.75), 0.56),
    ("car-paint", "ball", (0.68, -0.75), 0.56),
    ("porcelain", "shell", (2.08, -0.5), 0.52),
    ("velvet", "ball", (-1.45, 0.75), 0.44),
    ("diamond", "brilliant", (-0.32, 1.15), 0.44),
    ("amber", "ball", (0.62, 1.15), 0.36),
    ("glass", "ball", (1.55, 0.75), 0.42),
)


def roughness() -> dict[str, Any]:
    """Nine gold spheres, roughness 0 to 1 from left to right."""
    scene = stages.stage(0.3)
    scene["camera"] = {"position": [0, 1.5, 14], "target": [0, 0.46, 0], "vfov": 10.3}
    for k in range(9):
        name = f"roughness {k / 8}"
        scene["materials"][name] = {
            "type": "disney", "base_color": [1, 0.77, 0.34], "metallic": 1, "roughness": k / 8,
        }  # fmt: skip
        stages.put(scene, name, type="sphere", center=[(k - 4) * 1.06, 0.5, 0], radius=0.5)
    stages.lamp(scene, (-5.0, 4.0, 3.0), (1.2, 3.0), [14, 13.5, 13])
    return stages.lamp(scene, (5.0, 3.0, -2.4), (0.8, 3.0), [16, 16.5, 17])


def materials() -> dict[str, Any]:
    """Eight of the material presets in a studio, on balls, in bowls and cut."""
    scene = stages.stage(0.28, 0.7)
    scene["camera"] = {"position": [0, 2.5, 8.6], "target": [0, 0.5, 0.1], "vfov": 18.5}
    scene["textures"] = {}
    for name, shape, (x, z), size in ROWS:
        document = presets.get("materials", name)
        scene["textures"] |= document.get("textures", {})
        scene["materials"][name] = stages.surface(document)
        if shape == "ball":
            stages.put(scene, name, type="sphere", center=[x, size, z], radius=size)
            continue
        turned = [38, 12, 0] if shape == "brilliant" else [34, 0, -30 if x < 0 else 30]
        height = size * (0.7 if shape == "brilliant" else 1)
        transform = {"rotate": turned, "translate": [x, height, z], "scale": size}
        stages.put(scene, name, **getattr(shapes, shape)(), transform=transform)
    stages.lamp(scene, (-4.2, 3.4, -2.2), (1.4, 2.4), [15, 14.5, 14])
    stages.lamp(scene, (4.2, 3.4, -2.2), (1.4, 2.4), [15, 15.4, 16])
    return stages.lamp(scene, (-3.2, 4.4, 4.6), (1.8, 1.8), [9, 8.7, 8.2])


def preset(name: str) -> Callable[[], dict[str, Any]]:
    return lambda: presets.get("scenes", name)


PICTURES: dict[str, tuple[Callable[[], dict[str, Any]], tuple[int, int, int]]] = {
    # scene, (width, height, samples)
    "roughness": (roughness, (1200, 280, 96)),
    "materials": (materials, (960, 480, 128)),
    "cornell": (preset("cornell-boxes"), (512, 512, 256)),
    "shader-ball": (preset("shader-ball"), (800, 600, 128)),
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
        page.wait_for_selector("#stage.live", timeout=120_000)
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
        document, (width, height, samples) = PICTURES[name]
        with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
            json.dump(document(), file)
            file.flush()
            command: list[str | Path] = [
                sunbox,
                "render",
                file.name,
                "-o",
                OUT / f"{name}.png",
            ]
            # Of Sobol' points the denoiser keeps a pattern in clear glass.
            command += ["--set", "denoise=true", "--set", "clamp=20", "--set", "sampler=independent"]
            command += ["--spp", str(samples), "--set", f"width={width}", "--set", f"height={height}"]
            subprocess.run(command, check=True)
    return 0
