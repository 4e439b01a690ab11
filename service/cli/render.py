"""`sunbox render`: a scene's document in, a picture in a file out.

Cheap checks come before expensive ones: arguments, document, settings, assets, OpenGL.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service import displays
from service.cli import BadInput, Failed, configuration, files
from service.cli.documents import (
    Source,
    pack_scene,
    picture_size,
    read_settings,
    read_source,
    refusals,
    source_assets,
)
from service.views import AOVS, COLOR_SPACES, LEAST_EXPOSURE, MOST_EXPOSURE, TONE_MAPS, LosslessFormat

if TYPE_CHECKING:
    from service.cli.assets import SourceAssets
    from service.cli.tracing import Tracing
    from service.formats.images.cryptomatte import Cryptomatte
    from service.formats.images.recipe import PictureView
    from service.ipc.messages import Lut


@dataclass(frozen=True)
class Output:
    """The path, the format and the view of the picture."""

    path: Path
    format: LosslessFormat
    view: PictureView
    names: dict[str, list[str]] | None = None  # of shapes and materials, for Cryptomatte

    def matte(self, tracing: Tracing) -> Cryptomatte | None:
        """Coverage of each pixel by shapes and materials; None where it was not asked for."""
        from service.formats.images.cryptomatte import LAYERS, Cryptomatte
        from service.ipc.messages import View

        if self.names is None:
            return None
        return Cryptomatte({aov: tracing.pixels(View(aov, encoding="linear")) for aov in LAYERS}, self.names)

    @property
    def is_repeatable(self) -> bool:
        """True if the file's metadata says what the picture was made from."""
        from service.formats import images

        return images.FORMATS[self.format].has_metadata


def run(arguments: argparse.Namespace) -> int:
    began = time.perf_counter()
    path, format, exposure = _arguments(arguments)
    stats = files.writable(Path(arguments.stats)) if arguments.stats else None
    config = configuration()
    given = read_settings(arguments.set or [], config)
    from service.system.garbage import loaded
    from service.system.shared_memory import reuse_freed  # here, as it loads numpy

    reuse_freed()
    from service.formats.images.cryptomatte import names_of

    source = read_source(Path(arguments.input), arguments.asset_root, config, arguments.entry)
    output = Output(path, format, _view(arguments, format, exposure, source.view))
    if arguments.cryptomatte:
        output = replace(output, names=names_of(source.document))
    size = picture_size(given, source.aspect_ratio)
    base = source.settings | size
    chosen = read_settings(arguments.set or [], config, base) if base else given
    _print_notes(source, output, exposure, (chosen.width, chosen.height) if size else None)
    with source_assets(source, arguments.asset_root, config) as assets:
        packed = pack_scene(source, assets, config)
        with refusals():
            document, names = assets.by_id(source.document) if output.is_repeatable else (None, {})
            output, lut = _with_lut(output, assets)
        from gpu import GpuError
        from service.cli.tracing import Interrupt, Tracing
        from service.document.quality import resolve
        from service.worker.in_process import InProcessRenderer

        interrupt = Interrupt()
        try:
            with interrupt.watch(), InProcessRenderer(config.device) as renderer:
                tracing = Tracing(renderer, packed, resolve(chosen))
                setup_s = time.perf_counter() - began
                loaded()
                tracing.run(interrupt)
                files.write(output.path, _encode(tracing, output, document, names, lut))
                tracing.close()
        except GpuError as error:
            raise Failed(str(error)) from None
        if stats:
            files.write(stats, (json.dumps(tracing.status(setup_s), indent=1) + "\n").encode())
        for warning in tracing.warnings:
            if warning.partition(": ")[2] not in source.warned:
                print(f"warning: {warning}", file=sys.stderr)
        if output.is_repeatable:
            assets.keep(source.document)
    return 128 + interrupt.signal if interrupt.signal is not None else 0


def _arguments(arguments: argparse.Namespace) -> tuple[Path, LosslessFormat, float | None]:
    """The path, the format, and the exposure where one is given."""
    path = Path(arguments.output)
    format = files.picture_format(arguments.output)
    if arguments.aov is not None:
        _choose("--aov", arguments.aov, (*AOVS, "all"))
    if arguments.aov == "all" and format != "exr":
        raise BadInput("--aov all: only an .exr file holds more than one; name one of " + ", ".join(AOVS))
    if arguments.cryptomatte and (format != "exr" or arguments.aov not in (None, "color", "all")):
        raise BadInput("--cryptomatte: is for an .exr file, with --aov color or all")
    if arguments.tone_map is not None:
        _check_tone_map(arguments.tone_map)
    if arguments.color_space is not None:
        _choose("--color-space", arguments.color_space, COLOR_SPACES)
    exposure = None
    if arguments.exposure is not None:
        try:
            exposure = float(arguments.exposure)
        except ValueError:
            exposure = math.nan
        if not LEAST_EXPOSURE <= exposure <= MOST_EXPOSURE:
            within = f"from {LEAST_EXPOSURE} to {MOST_EXPOSURE}"
            raise BadInput(f"--exposure {arguments.exposure!r}: must be a number of stops {within}")
    return files.writable(path), format, exposure


def _view(
    arguments: argparse.Namespace, format: str, exposure: float | None, before: PictureView | None
) -> PictureView:
    """The view as given; the rest comes from the picture that is made again, if it is one."""
    from service.document.grading import shown_as
    from service.formats.images.recipe import PictureView

    options = {
        "aov": arguments.aov,
        "exposure": exposure,
        "tone_map": arguments.tone_map,
        "color_space": arguments.color_space,
        "lut": arguments.lut,
    }
    given = {name: value for name, value in options.items() if value is not None}
    view = (before or PictureView()).model_copy(update=given)
    if format == "png":
        with refusals():
            shown_as(view.tone_map, view.color_space)
    return view.model_copy(update={"aov": "color"}) if view.aov == "all" and format != "exr" else view


def _print_notes(source: Source, output: Output, exposure: float | None, size: tuple[int, int] | None) -> None:
    """Print the values that were taken from a model because the command line does not give them."""
    if size:
        print(f"note: {size[0]} x {size[1]} pixels, as wide for its height as the camera's picture", file=sys.stderr)
    is_model = source.store is not None
    if is_model and source.view and exposure is None and output.format == "png":
        stops = f"{source.view.exposure:g}"
        print(f"note: exposure {stops}, which suits the file's lights; --exposure sets another", file=sys.stderr)


def _check_tone_map(name: str) -> None:
    if not name.startswith(displays.PREFIX):
        _choose("--tone-map", name, (*TONE_MAPS, f"{displays.PREFIX}DISPLAY/VIEW"))
    elif wrong := displays.mistake(name):
        raise BadInput(f"--tone-map {name!r}: {wrong}")


def _choose(option: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise BadInput(f"{option} {value!r}: is not one of {', '.join(known)}")


def _with_lut(output: Output, assets: SourceAssets) -> tuple[Output, Lut | None]:
    """The output, which names its table of colours by id, and the table."""
    from service.ipc.messages import Lut

    if output.view.lut is None or output.format != "png":
        return output, None
    id, found = assets.lut(output.view.lut)
    named = replace(output, view=output.view.model_copy(update={"lut": id}))
    return named, Lut(id, found.values, found.low, found.high)


def _encode(tracing: Tracing, output: Output, document: Any, names: dict[str, str], lut: Lut | None) -> bytes:
    from service.formats import images
    from service.formats.images import recipe
    from service.ipc.messages import View

    view, made_from = output.view, None
    if output.is_repeatable:
        made_from = recipe.write(document, tracing.settings, tracing.progress.samples, view, names)
    if view.aov == "all":
        return images.encode_layers(
            {aov: tracing.pixels(View(aov, encoding="linear")) for aov in AOVS}, made_from, output.matte(tracing)
        )
    if output.names is not None:
        color = tracing.pixels(View("color", encoding="linear"))
        return images.encode_layers({"color": color}, made_from, output.matte(tracing))
    encoding = images.FORMATS[output.format].encoding(view.bits)
    p3 = view.color_space == "display_p3"
    pixels = tracing.pixels(View(view.aov, view.exposure, view.tone_map, encoding, p3, lut))
    stands = displays.encoding_of(view.tone_map, p3) if view.aov == "color" else displays.SRGB
    return images.encode(pixels, output.format, bits=view.bits, metadata=made_from, encoding=stands)
