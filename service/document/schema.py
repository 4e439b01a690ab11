"""The JSON Schema of what a person writes, with the hints that the editor builds its controls from; and a material's
model in few words, for a person, or a program that reads text, that writes one.
"""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema
from pydantic_core.core_schema import ModelSchema, TaggedUnionSchema, WithDefaultSchema

from service.document.base import field_names
from service.document.document import Scene
from service.document.settings import Settings
from service.document.texture import REFERENCE_TAG, VALUE_TAG

Schema = dict[str, Any]


class _Schema(GenerateJsonSchema):
    def model_schema(self, schema: ModelSchema) -> dict[str, Any]:
        described = super().model_schema(schema)
        described["properties"] = {name: described["properties"][name] for name in field_names(schema["cls"])}
        return described

    def tagged_union_schema(self, schema: TaggedUnionSchema) -> dict[str, Any]:
        """A value or a reference to a texture as one flat list of forms."""
        described = super().tagged_union_schema(schema)
        if set(schema["choices"]) != {VALUE_TAG, REFERENCE_TAG}:
            return described
        forms = [form for choice in described["oneOf"] for form in choice.get("anyOf", [choice])]
        return {"anyOf": forms}

    def default_schema(self, schema: WithDefaultSchema) -> dict[str, Any]:
        """Without `default: null`: that field may be left out, but null is no value for it."""
        described = super().default_schema(schema)
        if described.get("default", ...) is None:
            del described["default"]
        return described


def schema() -> dict[str, Any]:
    """`{"scene": ..., "settings": ...}`; each with its models by name in `$defs`."""
    return {"scene": _of(Scene), "settings": _of(Settings)}


def _of(model: type[BaseModel]) -> dict[str, Any]:
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **model.model_json_schema(schema_generator=_Schema),
    }


def model_schema(scene: Schema, model: str) -> Schema | None:
    """The schema of a material's model, with what it refers to in `$defs`; None where there is no such model.
    `scene`: the schema of the scene."""
    definitions: Schema = scene["$defs"]
    materials = {name: each for name, each in definitions.items() if name.endswith("Material")}
    name = next((name for name, each in materials.items() if _type(each) == model), None)
    if name is None:
        return None
    needed, found = [name], dict[str, Schema]()
    while needed:
        each = needed.pop()
        found[each] = definitions[each]
        needed += [ref for ref in _references(found[each]) if ref not in found]
    return {**found.pop(name), "$defs": found}


def brief(schema: Schema) -> Schema:
    """A model's schema in short: a line for each field with its range, unit and default."""
    fields = {name: _field(each) for name, each in schema["properties"].items() if name != "type"}
    described = {"type": schema["properties"]["type"]["const"], "description": schema.get("description", "")}
    return described | {"required": [name for name in schema.get("required", ()) if name != "type"], "fields": fields}


def _field(field: Schema) -> Schema:
    forms = field.get("anyOf", [field])
    numbers = [form for form in forms if form.get("type") in ("number", "integer")]
    out: Schema = {"is": _kind(field, forms)}
    for form in numbers[:1]:
        least, most = form.get("exclusiveMinimum"), form.get("exclusiveMaximum")
        out["range"] = [form.get("minimum", least), form.get("maximum", most)]
    if field.get("x-unit"):
        out["unit"] = field["x-unit"]
    if "default" in field:
        out["default"] = field["default"]
    if "description" in field:
        out["about"] = field["description"]
    return out


def _kind(field: Schema, forms: list[Schema]) -> str:
    choices = [each for form in forms for each in form.get("enum", [form["const"]] if "const" in form else [])]
    if choices:
        return " | ".join(map(str, choices))
    kinds = {form.get("type") for form in forms}
    textured = any("Texture" in form.get("$ref", "") for form in forms)
    names = ("number", "integer", "boolean", "string", "array")
    kind = next((each for each in names if each in kinds), "object")
    if field.get("x-widget") == "color":
        kind = "colour: [r, g, b], #rrggbb or a number"
    return f"{kind}, or {{texture: NAME}}" if textured else kind


def _type(definition: Schema) -> str | None:
    found: str | None = definition.get("properties", {}).get("type", {}).get("const")
    return found


def _references(node: Any) -> list[str]:
    if isinstance(node, dict):
        direct = [node["$ref"].rpartition("/")[2]] if isinstance(node.get("$ref"), str) else []
        return direct + [ref for value in node.values() for ref in _references(value)]
    return [ref for value in node for ref in _references(value)] if isinstance(node, list) else []
