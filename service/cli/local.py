"""Renders in a Python program's own process, with the bits of `sunbox render`.

`sunbox.render` finds this module by the entry point `sunbox.renderers`, and calls what `__all__` names.

All calls come from one thread, which has the OpenGL context.
"""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from gpu import GpuError
from service.cli.documents import Source, source_assets
from service.cli.tracing import Interrupt, Tracing
from service.config import Config, load_config
from service.displays import SRGB
from service.document import parse_scene, parse_settings
from service.document.grading import shown_as
from service.document.quality import resolve
from service.document.validation import both, validated
from service.formats import images
from service.formats.images.recipe import PictureView, write
from service.ipc.messages import Lut, View
from service.pack import pack
from service.problems import FieldError, Internal, InvalidDocument, ServiceError, problem
from service.views import AOVS, FileFormat
from service.worker.in_process import InProcessRenderer

__all__ = ["Interrupt", "LocalRenderer", "ServiceError", "as_problem", "stop"]
_VIEW: TypeAdapter[PictureView] = TypeAdapter(PictureView)


class LocalRenderer:
    """A renderer of this process. Raises ServiceError, which `as_problem` turns into what a server would answer."""

    def __init__(self) -> None:
        self._config: Config = load_config()
        try:
            self._renderer = InProcessRenderer(self._config.device)
        except GpuError as error:
            raise Internal(str(error)) from None

    def render(
        self, document: Any, settings: Mapping[str, Any], folder: Path, interrupt: Interrupt | None = None
    ) -> LocalPicture:
        """A picture of a scene's document; it names files by paths relative to `folder`. Raises InvalidDocument with
        pointers as `POST /v1/renders` has them."""
        began = time.perf_counter()
        scene, chosen = both(
            partial(parse_scene, document, "/scene", self._config),
            partial(parse_settings, dict(settings), "/settings", self._config),
        )
        source = Source(folder / "scene", document, scene)
        with source_assets(source, [], self._config) as assets:
            try:
                packed = pack(scene, assets, limits=self._config)
            except InvalidDocument as error:
                raise error.under("/scene") from None
            identified, names = assets.by_id(document)
            assets.keep(document)  # so that pictures, which name files by id, can be made again
        try:
            tracing = Tracing(self._renderer, packed, resolve(chosen))
            setup_s = time.perf_counter() - began
            tracing.run(interrupt or Interrupt())
        except GpuError as error:
            raise Internal(str(error)) from None

        def lut(ref: str) -> Lut:
            with source_assets(source, [], self._config) as assets:
                id, found = assets.lut(ref)
            return Lut(id, found.values, found.low, found.high)

        return LocalPicture(tracing, tracing.status(setup_s), identified, names, lut)


class LocalPicture:
    """A picture whose samples lie on the GPU until `close`. `status` as `GET /v1/renders/{id}` would answer."""

    def __init__(
        self,
        tracing: Tracing,
        status: dict[str, Any],
        document: Any,
        names: dict[str, str],
        lut: Callable[[str], Lut],
    ) -> None:
        """`lut` reads the table of colours that a view names."""
        self._tracing, self._document, self._names, self._lut = tracing, document, names, lut
        self.status = status

    def encoded(self, format: FileFormat, view: Mapping[str, Any]) -> bytes:
        """A file; `view`: aov, bits, exposure, tone_map, color_space, lut. Raises InvalidDocument."""
        row = images.FORMATS.get(format)
        if row is None:
            raise InvalidDocument(
                [FieldError("/format", f"must be one of {', '.join(images.FORMATS)}, not {format!r}")]
            )
        look = validated(_VIEW, dict(view), "")
        lut = self._lut(look.lut) if look.lut is not None else None
        if lut is not None:
            look = look.model_copy(update={"lut": lut.key})
        made_from = None
        if row.has_metadata:
            made_from = write(
                self._document, self._tracing.settings, self._tracing.progress.samples, look, self._names
            )
        if look.aov == "all":
            if format != "exr":
                raise InvalidDocument([FieldError("/aov", "all is for exr alone")])
            layers: dict[str, Any] = {aov: self._tracing.pixels(View(aov, encoding="linear")) for aov in AOVS}
            return images.encode_layers(layers, made_from)
        stands = shown_as(look.tone_map, look.color_space, format) if look.aov == "color" else SRGB
        p3 = look.color_space == "display_p3"
        pixels = self._tracing.pixels(View(look.aov, look.exposure, look.tone_map, row.encoding(look.bits), p3, lut))
        return images.encode(pixels, format, bits=look.bits, metadata=made_from, encoding=stands)

    def close(self) -> None:
        """Free its memory on the GPU."""
        self._tracing.close()


def stop(interrupt: Interrupt) -> None:
    """End the render that watches `interrupt`; may be called from any thread."""
    interrupt.signal = signal.SIGINT


def as_problem(error: ServiceError) -> tuple[int, Any]:
    """The status and the document that a server would answer."""
    document = problem(error)
    return int(document["status"]), document
