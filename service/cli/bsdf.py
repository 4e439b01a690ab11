"""`sunbox bsdf`: curves of a material's BSDF, into a table or a figure. The numbers are those of the renderer.

The input is checked before OpenGL is loaded.
"""

from __future__ import annotations

import argparse
import math
import sys
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli import BadInput, Failed, configuration, files
from service.cli.documents import refusals

if TYPE_CHECKING:
    from gpu import SceneArrays
    from service.config import Config
    from service.document import Material

FORMATS = (".csv", ".svg", ".png")
LARGEST_ANGLE = 89.9  # degrees
DEFAULT_ANGLE = 45.0
NEEDS_TERMS = ("distribution", "geometry", "fresnel")


def run(arguments: argparse.Namespace) -> int:
    path = Path(arguments.output)
    format = path.suffix.lower()
    if format not in FORMATS:
        raise BadInput(f"-o {arguments.output!r}: must end in one of {', '.join(FORMATS)}")
    if format != ".csv" and find_spec("matplotlib") is None:
        raise BadInput(
            f"-o {arguments.output!r}: needs matplotlib, which the extra `plot` brings: "
            "pip install '.[plot]' in a checkout of Sunbox"
        )
    if arguments.lobes and arguments.kind != "polar":
        raise BadInput(f"--lobes: goes with --kind polar, not with {arguments.kind}")
    angles = list(dict.fromkeys(map(_angle, arguments.angle or [DEFAULT_ANGLE])))
    output = files.writable(path)
    config = configuration()
    given = [Path(name) for name in (arguments.material, arguments.other) if name is not None]
    materials = [_material(each, arguments.kind) for each in given]
    packed = [_packed(path, each, config) for path, each in zip(given, materials, strict=True)]
    from gpu import GpuError
    from service.cli.bsdf_curves import curves_of
    from service.worker.in_process import InProcessRenderer

    names = [each.stem for each in given]
    if len(set(names)) < len(names):
        names = [str(each) for each in given]
    try:
        with InProcessRenderer(config.device) as renderer:
            curves = [curves_of(renderer, each, arguments.kind, angles, arguments.lobes) for each in packed]
    except GpuError as error:
        raise Failed(str(error)) from None
    for each, found in zip(given, curves, strict=True):
        if found.missing:
            raise BadInput(f"{each}: /roughness: {found.missing}")
    named = dict(zip(names, curves, strict=True))
    if format == ".csv":
        from service.cli.bsdf_curves import table

        data = table(named).encode()
    else:
        from service.cli.bsdf_figure import draw

        data = draw(named, format[1:])
    files.write(output, data)
    for name, found in named.items():
        for note in found.notes:
            print(f"note: {name}: {note}", file=sys.stderr)
    return 0


def _angle(value: str | float) -> float:
    try:
        angle = float(value)
    except ValueError:
        angle = math.nan
    if not 0 <= angle <= LARGEST_ANGLE:
        raise BadInput(f"--angle {value!r}: must be a number of degrees from 0 to {LARGEST_ANGLE}")
    return angle


def _packed(path: Path, material: Material, config: Config) -> SceneArrays:
    """With the file that it refers to, which stands beside it or was uploaded."""
    from service.pack import pack_material
    from service.server.assets import FileAssets
    from service.server.storage.stores import storage

    found = closing(storage(config).assets)
    with refusals(f"{path}: "), found as store, FileAssets(path.parent, [], store) as assets:
        return pack_material(material, assets, config)


def _material(path: Path, kind: str) -> Material:
    data = files.read(path)
    from service.document import load_json
    from service.problems import FieldError, InvalidDocument
    from service.server.requests.bsdf_request import parse_material, without_terms

    with refusals(f"{path}: "):
        material = parse_material(load_json(data))
        if kind in NEEDS_TERMS and (detail := without_terms(material)):
            raise InvalidDocument([FieldError("/type", detail)])
    return material
