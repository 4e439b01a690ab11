"""What JSON bodies are read as, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

from service.config import Config
from service.requests.batch_request import parse_batch
from service.requests.bsdf_request import parse_albedo, parse_terms, parse_values
from service.requests.compare_request import parse_compare
from service.requests.conversion_request import parse_conversion
from service.requests.export_request import parse_export
from service.requests.request_parser import RequestParser
from service.scene import load_json
from service.storage.documents import checked

Kind = Literal[
    "render", "keyed_render", "batch", "request", "scene", "scenes", "materials", "bsdf", "albedo", "terms",
    "conversion", "comparison", "export",
]  # fmt: skip
# What can be asked of a process that parses large bodies, by name.
PARSERS: dict[Kind, Callable[[Config, bytearray | memoryview], Any]] = {
    "render": lambda config, body: RequestParser(config).render(body),
    "keyed_render": lambda config, body: RequestParser(config).render(body, keyed=True),
    "batch": lambda config, body: parse_batch(config, body),
    "request": lambda config, body: RequestParser(config).request(body),
    "scene": lambda config, body: RequestParser(config).scene(load_json(body)),
    "scenes": lambda config, body: checked("scenes", load_json(body), config),
    "materials": lambda config, body: checked("materials", load_json(body), config),
    "bsdf": lambda config, body: parse_values(body),
    "albedo": lambda config, body: parse_albedo(body),
    "terms": lambda config, body: parse_terms(body),
    "conversion": lambda config, body: parse_conversion(body),
    "comparison": lambda config, body: parse_compare(config, body),
    "export": lambda config, body: parse_export(config, body),
}
