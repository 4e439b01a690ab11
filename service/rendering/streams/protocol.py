"""What a client may say on the stream, and how a frame is written."""

from __future__ import annotations

import json
import struct
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, TypeAdapter

from service import images
from service.problems import TooLarge
from service.rendering.ipc.messages import Encoding, Frame
from service.rendering.ipc.messages import View as PictureView
from service.scene.base import Model, hint
from service.scene.text import load_json, most_bytes
from service.scene.validation import validated

MOST_MEMORY = 32 << 20  # bytes, of a message's values: a mesh of 1 MiB takes 12 MB, as many empty arrays 36
GENERATIONS = 2**53  # what every JSON reader keeps exact
QUALITY, LAST_QUALITY = 80, 90  # JPEG: 4:2:0 while it converges, 4:4:4 for the frame that stays
MOST_FPS = 240
RAW = "application/octet-stream"


class View(Model):
    """How frames are to look; what a message leaves out stays as it was."""

    format: Literal["jpeg", "webp", "png", "rgba32f"] = "jpeg"
    quality: Annotated[int, Field(ge=1, le=100)] | None = None
    exposure: Annotated[
        float,
        Field(ge=-60, le=60),
        hint("Exposure", "In stops: each doubles the brightness.", unit="stops", widget="slider", soft=(-10, 10)),
    ] = 0.0
    tone_map: Annotated[
        Literal["linear", "exponential", "reinhard", "aces", "agx", "pbr_neutral"],
        hint("Tone map", "How radiance beyond white is brought onto the screen."),
    ] = "pbr_neutral"
    aov: Literal["color", "albedo", "normal", "depth", "variance", "shape_id", "material_id"] = "color"
    max_fps: Annotated[float, Field(gt=0, le=MOST_FPS)] | None = None
    bits: Annotated[Literal[8, 16], Field(description="Of a PNG's channels.")] = 8

    def for_renderer(self) -> PictureView:
        deep = self.format == "png" and self.bits == 16
        encoding: Encoding = "linear" if self.format == "rgba32f" else "f4" if deep else "u1"
        return PictureView(self.aov, self.exposure, self.tone_map, encoding)

    def over(self, view: View) -> View:
        """`view` with what this one says."""
        said = {name: getattr(self, name) for name in self.model_fields_set if name in View.model_fields}
        return view.model_copy(update=said)


class ViewMessage(View):
    type: Literal["view"]


class Start(Model):
    type: Literal["start"]
    generation: Annotated[int, Field(ge=-GENERATIONS, le=GENERATIONS)]
    scene: Any
    settings: Any = Field(default_factory=dict)
    view: View | None = None


class Update(Model):
    type: Literal["update"]
    generation: Annotated[int, Field(ge=-GENERATIONS, le=GENERATIONS)]
    scene: Any = Field(default_factory=dict)
    settings: Any = Field(default_factory=dict)


class Ack(Model):
    type: Literal["ack"]
    seq: int


class Bare(Model):
    type: Literal["pause", "resume", "stop", "ping"]


Message = Start | Update | ViewMessage | Ack | Bare
_MESSAGE: TypeAdapter[Message] = TypeAdapter(Annotated[Message, Field(discriminator="type")])


def parse(text: str) -> Message:
    """Raises MalformedJson, TooLarge, or InvalidDocument with pointers from the message's root."""
    if most_bytes(text) > MOST_MEMORY:
        raise TooLarge("What this message holds takes too much memory: big geometry goes through assets.")
    return validated(_MESSAGE, load_json(text), "")


def frame_bytes(frame: Frame, view: View, seq: int) -> bytes:
    """A frame's message: header length, header, image. Takes milliseconds."""
    mime, body = _encoded(frame, view)
    height, width = frame.pixels.shape[:2]
    progress = frame.progress
    header = {
        "generation": frame.generation,
        "seq": seq,
        "samples": progress.samples,
        "width": width,
        "height": height,
        "mime": mime,
        "noise": progress.noise,
        "elapsed_s": progress.elapsed_s,
        "eta_s": progress.eta_s,
        "scale": frame.scale,
    }
    if frame.denoised:
        header["denoised"] = True
    if progress.missing is not None:
        header["missing_light"] = progress.missing
    text = json.dumps(header, separators=(",", ":")).encode()
    return b"".join((struct.pack("<I", len(text)), text, body))


def _encoded(frame: Frame, view: View) -> tuple[str, bytes]:
    if view.format == "rgba32f":
        return RAW, _rgba(frame.pixels).tobytes()
    quality = view.quality or (LAST_QUALITY if frame.last else QUALITY)
    return images.MIME[view.format], images.encode(frame.pixels, view.format, bits=view.bits, quality=quality)


def _rgba(pixels: np.ndarray) -> np.ndarray:
    """(height, width, 4) float32: other AOVs become opaque, a single channel grey."""
    if pixels.shape[2] == 4:
        return np.ascontiguousarray(pixels, np.float32)
    out = np.ones((*pixels.shape[:2], 4), np.float32)
    out[..., :3] = pixels
    return out
