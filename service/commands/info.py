"""`sunbox info [SCENE.json]`: what would render here, within which limits, and what a scene asks of it."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.commands import Failed
from service.commands.configuration import configuration
from service.commands.documents import pack_scene, read_source, source_assets

if TYPE_CHECKING:
    from gpu import Renderer
    from service.pack import Packed
    from service.scene import Scene


def run(arguments: argparse.Namespace) -> int:
    rows = [("sunbox", metadata.version("sunbox"))]
    config = configuration()
    packed = None
    if arguments.scene:
        source = read_source(Path(arguments.scene), arguments.asset_root, config)
        with source_assets(source, arguments.asset_root, config) as assets:
            packed = pack_scene(source, assets, config)
        rows += [("scene", str(source.path)), *contents(source.scene, packed)]
    from gpu import GpuError, Renderer

    try:
        with Renderer(config.device) as renderer:
            if packed is not None:
                rows += kernel(renderer, packed, config.device)
            rows += [(name, str(renderer.info[name])) for name in ("renderer", "version", "vendor")]
    except GpuError as error:
        raise Failed(str(error)) from None
    rows += [("most pixels", f"{config.max_pixels:,}"), ("most triangles", f"{config.max_triangles:,}")]
    _print(rows)
    return 0


def contents(scene: Scene, packed: Packed) -> list[tuple[str, str]]:
    """What the scene is made of, a row for each kind of thing, and the kernel flags that it raises."""
    rows = [
        ("shapes", _counted(shape.type for shape in scene.shapes)),
        ("triangles", _triangles(packed)),
        ("materials", _counted(material.type for material in scene.materials.values())),
        ("lights", _counted(light.type for light in scene.lights)),
        ("environment", scene.environment.type if scene.environment else "none"),
    ]
    return rows + [("warning", warning) for warning in packed.warnings]


def _triangles(packed: Packed) -> str:
    held, shown = len(packed.arrays.triangles), len(packed.arrays.instances)
    return f"{held}, shared by {shown} instances" if shown else str(held)


def kernel(renderer: Renderer, packed: Packed, device: int | None) -> list[tuple[str, str]]:
    """What the scene's kernel is compiled for, what not, and what that saves; measured here and now."""
    from gpu import RenderSettings
    from gpu.analysis.kernel_cost import SIZE, full_kernel, kernel_cost
    from service.rendering.worker.helpers.compile_client import CompileClient

    settings = RenderSettings(SIZE, SIZE)
    price = kernel_cost(renderer, packed.arrays, settings)
    CompileClient(renderer.info, device, crowded=lambda: False).met(full_kernel(packed.arrays, settings))
    own, full = (f"{1e6 * s:.3g} us a sample and pixel" for s in (price.sample_s, price.full_sample_s))
    return [
        ("features", " ".join(price.raised) or "none"),
        ("not needed", " ".join(price.spared)),
        ("its kernel", f"compiled in {price.compile_ms:.0f} ms, {own} at 8 bounces"),
        ("one with all", f"compiled in {price.full_compile_ms:.0f} ms, {full}: {price.saving:.0%} is saved"),
    ]


def _counted(kinds: Iterable[str]) -> str:
    return ", ".join(f"{count} {kind}" for kind, count in Counter(kinds).most_common()) or "none"


def _print(rows: list[tuple[str, Any]]) -> None:
    width = max(len(name) for name, _ in rows)
    for name, value in rows:
        print(f"{name:{width}}  {value}")
