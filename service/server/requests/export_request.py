"""Bodies that ask for a scene as a file of another program, checked."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

from pydantic import TypeAdapter

from service.config import Config
from service.document import Scene, load_json
from service.document.base import Model
from service.document.validation import both, validated
from service.exports import scene_format
from service.server.requests.request_parser import RequestParser


class ExportBody(Model):
    scene: Any
    format: str


_BODY: TypeAdapter[ExportBody] = TypeAdapter(ExportBody)


@dataclass(frozen=True)
class ParsedExport:
    scene: Scene
    format: str


def parse_export(config: Config, body: bytes | bytearray | memoryview) -> ParsedExport:
    """Raises MalformedJson, InvalidDocument with pointers from the body's root."""
    asked = validated(_BODY, load_json(body), "")
    scene, _ = both(partial(RequestParser(config).scene, asked.scene), partial(scene_format, asked.format))
    return ParsedExport(scene, asked.format)
