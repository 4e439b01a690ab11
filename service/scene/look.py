"""By what a picture is shown: the tone map, as requests and metadata name it."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, WithJsonSchema

from service import displays
from service.scene.base import refusal
from service.views import TONE_MAPS


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


# The short names come first: they are what an editor offers.
_SCHEMA = {"anyOf": [{"type": "string", "enum": list(names)} for names in (TONE_MAPS, displays.names())]}
ToneMap = Annotated[str, AfterValidator(_known), WithJsonSchema(_SCHEMA)]
