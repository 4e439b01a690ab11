"""By what a picture is shown: its tone map and its colour space, as requests and metadata name them."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field, WithJsonSchema

from service import displays
from service.document.base import refusal
from service.problems import FieldError, InvalidDocument
from service.views import TONE_MAPS, ColorSpace


def _known(tone_map: str) -> str:
    if tone_map.startswith(displays.PREFIX):
        wrong = displays.mistake(tone_map)
    else:
        wrong = None if tone_map in TONE_MAPS else _among()
    if wrong:
        raise refusal(wrong)
    return tone_map


def _among() -> str:
    return f"must be one of {', '.join(TONE_MAPS)}, or {displays.PREFIX}DISPLAY/VIEW, which GET /v1/info lists"


def shown_as(tone_map: str, color_space: ColorSpace, format: str = "png") -> displays.Encoding:
    """The meaning of a file's numbers. Raises InvalidDocument where its format cannot state it."""
    p3 = color_space == "display_p3"
    encoding = displays.encoding_of(tone_map, p3)
    if p3 and encoding != displays.DISPLAY_P3:
        raise InvalidDocument([FieldError("/color_space", "must be left out: the tone map names another display")])
    if encoding.transfer == "pq" and format in ("jpeg", "webp", "avif"):
        detail = f"is for an HDR display (PQ), which a {format} file here cannot say: png can"
        raise InvalidDocument([FieldError("/tone_map", detail)])
    return encoding


Lut = Annotated[
    str | None,
    Field(max_length=100, description="The id of a .cube asset, through which displayed colours go last."),
]
# The short names come first: they are what an editor offers.
_SCHEMA = {"anyOf": [{"type": "string", "enum": list(names)} for names in (TONE_MAPS, displays.names())]}
ToneMap = Annotated[str, AfterValidator(_known), WithJsonSchema(_SCHEMA)]
