"""The messages that a client may send on the stream, and how a frame is written."""

from __future__ import annotations

import json
import struct
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter

from service.displays import SRGB, encoding_of
from service.document.base import Model, hint
from service.document.grading import Lut, ToneMap
from service.document.text import load_json, most_bytes
from service.document.validation import validated
from service.formats import images
from service.ipc import messages
from service.problems import TooLarge
from service.views import DEFAULT_TONE_MAP, LEAST_EXPOSURE, MOST_EXPOSURE, Aov, Bits, ColorSpace, StreamFormat

MOST_MEMORY = 32 << 20  # bytes, of a message's values: a mesh of 1 MiB takes 12 MB, as many empty arrays 36
GENERATIONS = 2**53  # what every JSON reader keeps exact
# JPEG: 4:2:0 while it converges, 4:4:4 for the frame that stays, and for small ones: enlarged, they would show blocks
# of colour.
QUALITY, LAST_QUALITY = 80, 90
MOST_FPS = 240


class View(Model):
    """How frames are to look; fields that a message leaves out stay as they were."""

    format: StreamFormat = "jpeg"
    quality: Annotated[int, Field(ge=1, le=100)] | None = None
    exposure: Annotated[
        float,
        Field(ge=LEAST_EXPOSURE, le=MOST_EXPOSURE),
        hint("Exposure", "In stops: each doubles the brightness.", unit="stops", widget="slider", soft=(-10, 10)),
    ] = 0.0
    tone_map: Annotated[
        ToneMap,
        hint("Tone map", "How radiance beyond white is brought onto the screen."),
    ] = DEFAULT_TONE_MAP
    color_space: ColorSpace = "srgb"
    lut: Lut = None
    aov: Aov = "color"
    max_fps: Annotated[float, Field(gt=0, le=MOST_FPS)] | None = None
    bits: Annotated[Bits, Field(description="Of a PNG's channels.")] = 8
    prior: Annotated[
        bool,
        Field(
            description="Whether frames after an edit may show a guess, of full size, until the picture has samples "
            "of its own: what it showed before, corrected by first looks. Their headers say `prior`."
        ),
    ] = False
    denoise: Annotated[
        bool,
        Field(
            description="Whether frames are shown denoised from the first sample on. That fades as the noise falls "
            "below 3 %, and ends at 1.5 %. It is for the eye alone: the setting `denoise` is for what is kept. The "
            "headers of such frames say `denoised`; their `noise` is that of the rendered picture."
        ),
    ] = False

    def for_renderer(self, lut: messages.Lut | None = None) -> messages.View:
        encoding = images.FORMATS[self.format].encoding(self.bits)
        shown = self.aov, self.exposure, self.tone_map, encoding, self.p3, lut
        return messages.View(*shown, self.prior, self.denoise)

    @property
    def p3(self) -> bool:
        return self.color_space == "display_p3"

    def over(self, view: View) -> View:
        """`view` with the fields that this message gives."""
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
    renderers: Annotated[int, Field(ge=1, description="Most renderers that trace it; more than there are: all.")] = 1


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


def frame_bytes(frame: messages.Frame, view: View, seq: int) -> bytes:
    """A frame's message: header length, header, image. Takes milliseconds."""
    small = frame.scale < 1.0 and not frame.prior
    quality = view.quality or (LAST_QUALITY if frame.last or small else QUALITY)
    stands = encoding_of(view.tone_map, view.p3) if view.aov == "color" else SRGB
    body = images.encode(frame.pixels, view.format, bits=view.bits, quality=quality, encoding=stands)
    height, width = frame.pixels.shape[:2]
    progress = frame.progress
    header = {
        "generation": frame.generation,
        "seq": seq,
        "samples": progress.samples,
        "width": width,
        "height": height,
        "mime": images.FORMATS[view.format].mime,
        "noise": progress.noise,
        "elapsed_s": progress.elapsed_s,
        "eta_s": progress.eta_s,
        "scale": frame.scale,
    }
    header |= {name: True for name in ("denoised", "prior") if getattr(frame, name)}
    text = json.dumps(header, separators=(",", ":")).encode()
    return b"".join((struct.pack("<I", len(text)), text, body))
