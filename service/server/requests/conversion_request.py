"""Bodies that ask for a material as one of another model, checked and answered: it takes less than a ms."""

from __future__ import annotations

from pydantic import Field, TypeAdapter

from service.document import Material, load_json
from service.document.base import Model
from service.document.material import MODELS
from service.document.material.conversion import Converted, Document, converted, parameters
from service.document.validation import among, validated
from service.problems import FieldError, InvalidDocument, escaped


class ConversionBody(Model):
    material: Material
    to: str
    choose: dict[str, str] = Field(default_factory=dict)


_BODY = TypeAdapter(ConversionBody)


def parse_conversion(body: bytes | bytearray | memoryview) -> Converted:
    """The converted material. Raises MalformedJson, InvalidDocument."""
    document = load_json(body)
    parsed = validated(_BODY, document, "")
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
