"""`sunbox info [SCENE.json] [--measure]`: what a scene contains and needs, what would render it here, and EGL's
devices."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli import BadInput, Failed, configuration
from service.cli.documents import pack_scene, read_source, source_assets

if TYPE_CHECKING:
    from service.document import Scene
    from service.pack import Packed
    from service.worker.in_process import InProcessRenderer

WIDTH = len("most triangles")  # of the names of rows


def run(arguments: argparse.Namespace) -> int:
    if arguments.measure and not arguments.scene:
        raise BadInput("--measure: name the scene whose kernel is to be measured")
    config = configuration()
    packed = None
    if arguments.scene:
        source = read_source(Path(arguments.scene), arguments.asset_root, config, arguments.entry)
        with source_assets(source, arguments.asset_root, config) as assets:
            packed = pack_scene(source, assets, config)
        _print([("scene", str(source.path)), *contents(source.scene, packed)])
    from gpu import GpuError
    from service.worker.in_process import InProcessRenderer
    from service.worker.list_devices import names

    try:
        with InProcessRenderer(config.device) as renderer:
            if packed is not None:
                _print(kernel(renderer, packed))
            if packed is not None and arguments.measure:
                _print(measured(renderer, packed))
            rows = [("sunbox", metadata.version("sunbox-server"))]
            rows += [(name, str(renderer.info[name])) for name in ("renderer", "version", "vendor")]
        rows += [(f"device {number}", name) for number, name in enumerate(names())]
    except GpuError as error:
        raise Failed(str(error)) from None
    _print([*rows, ("most pixels", f"{config.max_pixels:,}"), ("most triangles", f"{config.max_triangles:,}")])
    return 0


def contents(scene: Scene, packed: Packed) -> list[tuple[str, str]]:
    """The scene's contents, a row for each kind of thing."""
    rows = [
        ("shapes", _counted(shape.type for shape in scene.shapes)),
        ("triangles", _triangles(packed)),
        ("materials", _counted(material.type for material in scene.materials.values())),
        ("lights", _counted(light.type for light in scene.lights)),
        ("environment", scene.environment.type if scene.environment else "none"),
    ]
    return rows + [("warning", warning) for warning in packed.warnings]


def _triangles(packed: Packed) -> str:
    stored, shown = len(packed.arrays.triangles), len(packed.arrays.instances)
    return f"{stored}, shared by {shown} instances" if shown else str(stored)


def kernel(renderer: InProcessRenderer, packed: Packed) -> list[tuple[str, str]]:
    """The features that the scene's kernel is compiled for; nothing is compiled."""
    return [("features", " ".join(renderer.features(packed.arrays)) or "none")]


def measured(renderer: InProcessRenderer, packed: Packed) -> list[tuple[str, str]]:
    """Rows on what the scene's kernel saves beside the one for many scenes; both are compiled, and measured here and
    now."""
    print("compiling and measuring; the kernel for many scenes may take minutes", file=sys.stderr)
    price = renderer.kernel_cost(packed.arrays)
    specific, full = (f"{1e6 * s:.3g} us a sample and pixel" for s in (price.sample_s, price.full_sample_s))
    return [
        ("not needed", " ".join(price.spared)),
        ("its kernel", f"compiled in {price.compile_ms:.0f} ms, {specific} at 8 bounces"),
        ("that for many", f"compiled in {price.full_compile_ms:.0f} ms, {full}: {price.saving:.0%} is saved"),
    ]


def _counted(kinds: Iterable[str]) -> str:
    return ", ".join(f"{count} {kind}" for kind, count in Counter(kinds).most_common()) or "none"


def _print(rows: list[tuple[str, Any]]) -> None:
    """Print rows, and flush: the next ones may take long."""
    for name, value in rows:
        print(f"{name:{WIDTH}}  {value}", flush=True)
