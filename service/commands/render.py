"""`sunbox render`: a scene's document in, a picture in a file out.

The input is checked from the cheap to the dear: arguments, document, settings, assets; only then comes OpenGL.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from service.commands import BadInput, Failed, files
from service.commands.configuration import configuration
from service.commands.documents import pack_scene, read_scene, read_settings

if TYPE_CHECKING:
    from service.commands.tracing import Interrupt, Tracing
    from service.rendering.messages import Encoding

FORMATS = ("png", "exr", "hdr", "npy")
AOVS = ("color", "albedo", "normal", "depth", "variance", "shape_id", "material_id")
TONE_MAPS = ("linear", "exponential", "reinhard", "aces", "agx", "pbr_neutral")


@dataclass(frozen=True)
class Output:
    """What to write where; `aov` may be "all"."""

    path: Path
    format: str
    aov: str
    exposure: float
    tone_map: str


def run(arguments: argparse.Namespace) -> int:
    began = time.perf_counter()
    output = _output(arguments)
    stats = files.writable(Path(arguments.stats)) if arguments.stats else None
    config = configuration()
    source = Path(arguments.input)
    chosen = read_settings(arguments.set or [], config)
    scene = read_scene(source)
    packed = pack_scene(source, scene, arguments.asset_root, config)
    from gpu import GpuError, Renderer
    from service.commands.tracing import Interrupt, Tracing
    from service.quality import resolve

    interrupt = Interrupt()
    try:
        with interrupt.watch(), Renderer(config.device) as renderer:
            _render(Tracing(renderer, packed, resolve(chosen)), output, stats, began, interrupt)
    except GpuError as error:
        raise Failed(str(error)) from None
    return 128 + interrupt.signal if interrupt.signal is not None else 0


def _output(arguments: argparse.Namespace) -> Output:
    path = Path(arguments.output)
    format = path.suffix.lower().removeprefix(".")
    if format not in FORMATS:
        raise BadInput(f"-o {arguments.output!r}: must end in one of {', '.join('.' + f for f in FORMATS)}")
    _choose("--aov", arguments.aov, (*AOVS, "all"))
    if arguments.aov == "all" and format != "exr":
        raise BadInput("--aov all: only an .exr file holds more than one; name one of " + ", ".join(AOVS))
    _choose("--tone-map", arguments.tone_map, TONE_MAPS)
    try:
        exposure = float(arguments.exposure)
    except ValueError:
        exposure = math.nan
    if not -60 <= exposure <= 60:
        raise BadInput(f"--exposure {arguments.exposure!r}: must be a number of stops from -60 to 60")
    return Output(files.writable(path), format, arguments.aov, exposure, arguments.tone_map)


def _choose(option: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise BadInput(f"{option} {value!r}: is not one of {', '.join(known)}")


def _render(tracing: Tracing, output: Output, stats: Path | None, began: float, interrupt: Interrupt) -> None:
    setup_s = time.perf_counter() - began
    tracing.run(interrupt)
    files.write(output.path, _encode(tracing, output))
    if stats:
        files.write(stats, (json.dumps(tracing.status(setup_s), indent=1) + "\n").encode())
    for warning in tracing.warnings:
        print(f"warning: {warning}", file=sys.stderr)


def _encode(tracing: Tracing, output: Output) -> bytes:
    from service import images
    from service.rendering.messages import View

    made_from = {"settings": tracing.settings.document(), "samples": tracing.progress.samples}
    if output.aov == "all":
        return images.encode_layers({aov: tracing.pixels(View(aov, encoding="linear")) for aov in AOVS}, made_from)
    encoding: Encoding = "u1" if output.format == "png" else "linear"
    pixels = tracing.pixels(View(output.aov, output.exposure, output.tone_map, encoding))
    return images.encode(pixels, output.format, metadata=made_from)
