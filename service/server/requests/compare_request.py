"""The body of `POST /v1/compare`: two things that are to look the same, each a document or the name of a picture."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any

from pydantic import Field, TypeAdapter

from service.config import Config
from service.document import load_json
from service.document.base import Model
from service.document.validation import both, validated
from service.problems import FieldError, InvalidDocument
from service.server.requests.request_parser import ParsedRequest, RequestParser, SceneAndSettings, digest_of, folded

CONFIDENCE = 0.999
# Of a picture that is compared. More are no more certain, and one takes 640 bytes of memory while it is.
MOST_PIXELS = 2**22


class _CompareRequest(Model):
    a: Any
    b: Any
    confidence: Annotated[float, Field(gt=0, lt=1)] = CONFIDENCE


_REQUEST, _SIDE = TypeAdapter(_CompareRequest), TypeAdapter(SceneAndSettings)
Side = ParsedRequest | str  # a document, or the id of a render or of an asset


@dataclass(frozen=True)
class ParsedComparison:
    a: Side
    b: Side
    confidence: float
    same: bool  # whether both are one document, so that their pictures would be equal in bits


def parse_compare(config: Config, body: bytearray | memoryview) -> ParsedComparison:
    """Raises InvalidDocument with pointers from the root of the body, MalformedJson."""
    request = validated(_REQUEST, load_json(body), "")
    parser = RequestParser(config)
    a, b = both(partial(_side, parser, request.a, "/a"), partial(_side, parser, request.b, "/b"))
    same = False
    if isinstance(a, ParsedRequest) and isinstance(b, ParsedRequest):
        b = replace(b, settings=replace(b.settings, seed=a.settings.seed))
        same = a.settings == b.settings and digest_of(request.a["scene"]) == digest_of(request.b["scene"])
    return ParsedComparison(a, b, request.confidence, same)


def check_pixels(width: int, height: int) -> None:
    """Raise InvalidDocument for a picture that is too large to be compared."""
    if width * height > MOST_PIXELS:
        detail = f"has {width} x {height} pixels: pictures of at most {MOST_PIXELS} are compared"
        raise InvalidDocument([FieldError("", detail)])


def check_sizes(a: tuple[int, int], b: tuple[int, int]) -> None:
    """Raise InvalidDocument for pictures, (width, height), of two sizes."""
    if a != b:
        detail = f"has {b[0]} x {b[1]} pixels, and a {a[0]} x {a[1]}: both must have the same size"
        raise InvalidDocument([FieldError("/b", detail)])


def _side(parser: RequestParser, value: Any, pointer: str) -> Side:
    if isinstance(value, str):
        return value
    if not isinstance(value, dict):
        detail = "must be {scene, settings}, the id of a render, or sha256:... of an EXR file"
        raise InvalidDocument([FieldError(pointer, detail)])
    request = validated(_SIDE, value, pointer)
    try:
        scene, settings = parser.both(request.scene, request.settings)
    except InvalidDocument as error:
        raise error.under(pointer) from None
    return ParsedRequest(settings, scene, folded(request.scene))
