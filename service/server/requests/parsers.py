"""Parsers of JSON bodies, by name; and the classes that a reading is made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import is_dataclass
from functools import cache
from typing import Any, Literal, get_args, get_type_hints

from pydantic import Field, TypeAdapter

from service.config import Config
from service.document import Material, Scene, load_json
from service.document.base import Model
from service.document.material import MODELS
from service.document.material.conversion import Converted, Document, converted, parameters
from service.document.validation import among, validated
from service.formats.images import recipe
from service.problems import AssetError, FieldError, InvalidDocument, escaped
from service.server.requests.batch_request import parse_batch
from service.server.requests.bsdf_request import BsdfRequest, parse_albedo, parse_terms, parse_values
from service.server.requests.compare_request import parse_compare
from service.server.requests.export_request import parse_export
from service.server.requests.request_parser import ParsedRequest, RequestParser
from service.server.storage.documents import CheckedDocument, checked

Body = bytearray | memoryview
Kind = Literal[
    "render", "keyed_render", "batch", "request", "scene", "scenes", "materials", "bsdf", "albedo", "terms",
    "conversion", "comparison", "export", "recipe",
]  # fmt: skip


def _render(config: Config, body: Body) -> ParsedRequest:
    return RequestParser(config).render(body)


def _keyed_render(config: Config, body: Body) -> ParsedRequest:
    return RequestParser(config).render(body, keyed=True)


def _request(config: Config, body: Body) -> ParsedRequest:
    return RequestParser(config).request(body)


def _scene(config: Config, body: Body) -> Scene:
    return RequestParser(config).scene(load_json(body))


def _saved_scene(config: Config, body: Body) -> CheckedDocument:
    return checked("scenes", load_json(body), config)


def _recipe(config: Config, body: Body) -> CheckedDocument:
    try:
        return checked("scenes", recipe.read(load_json(body)).scene, config)
    except InvalidDocument as error:
        raise AssetError(f"the scene in the picture's metadata: {error}") from None


def _saved_material(config: Config, body: Body) -> CheckedDocument:
    return checked("materials", load_json(body), config)


def _bsdf(config: Config, body: Body) -> BsdfRequest:
    return parse_values(body)


def _albedo(config: Config, body: Body) -> BsdfRequest:
    return parse_albedo(body)


def _terms(config: Config, body: Body) -> BsdfRequest:
    return parse_terms(body)


def _conversion(config: Config, body: Body) -> Converted:
    return parse_conversion(body)


# What can be asked of a process that parses large bodies, by name. Which classes that process may send,
# `answer_classes` derives from what each says that it returns.
PARSERS: dict[Kind, Callable[[Config, Body], Any]] = {
    "render": _render,
    "keyed_render": _keyed_render,
    "batch": parse_batch,
    "request": _request,
    "scene": _scene,
    "scenes": _saved_scene,
    "materials": _saved_material,
    "bsdf": _bsdf,
    "albedo": _albedo,
    "terms": _terms,
    "conversion": _conversion,
    "comparison": parse_compare,
    "export": parse_export,
    "recipe": _recipe,
}


@cache
def answer_classes() -> frozenset[type]:
    """The classes that PARSERS return, and those of their fields, as the annotations say. Of a document's models only
    the outermost are among them: all are classes of `service.document`."""
    found = set[type]()
    for parse in PARSERS.values():
        _collect(get_type_hints(parse)["return"], found)
    return frozenset(found)


def _collect(annotation: Any, found: set[type]) -> None:
    """Add the service's own classes in an annotation."""
    if isinstance(annotation, type) and annotation.__module__.startswith("service.") and annotation not in found:
        found.add(annotation)
        for hint in get_type_hints(annotation).values() if is_dataclass(annotation) else ():
            _collect(hint, found)
    for part in get_args(annotation):
        _collect(part, found)


class ConversionBody(Model):
    material: Material
    to: str
    choose: dict[str, str] = Field(default_factory=dict)


_CONVERSION = TypeAdapter(ConversionBody)


def parse_conversion(body: bytes | bytearray | memoryview) -> Converted:
    """The converted material. Raises MalformedJson, InvalidDocument."""
    document = load_json(body)
    parsed = validated(_CONVERSION, document, "")
    before, after = type(parsed.material), MODELS.get(parsed.to)
    if after is None:
        raise InvalidDocument([FieldError("/to", f"is not known: {parsed.to[:40]!r}; known are {', '.join(MODELS)}")])
    found = converted(document["material"], before, after)
    material: Document = found.material
    for name, value in parsed.choose.items():
        _check_choice(after.name(), name, value)
        material = after.chosen(material, name, value)
    for name, parameter in parameters(after).items():
        if parameter.is_required and parameter.file_kind and name not in material:
            detail = (
                f"is required: {after.name()} is of a file, the id of an asset of the kind {parameter.file_kind!r}"
            )
            raise InvalidDocument([FieldError(f"/choose/{escaped(name)}", detail)])
    return Converted(material, found.lost)


def _check_choice(model: str, name: str, value: str) -> None:
    chosen = parameters(MODELS[model]).get(name)
    if chosen is not None and chosen.file_kind and value:
        return
    menus = {each: p.choices for each, p in parameters(MODELS[model]).items() if p.choices is not None}
    if name not in menus:
        detail = f"is no menu of {model}, which has {among(menus)}"
    elif value not in menus[name]:
        detail = f"must be one of {among(menus[name])}, not {value[:40]!r}"
    else:
        return
    raise InvalidDocument([FieldError(f"/choose/{escaped(name)}", detail)])
