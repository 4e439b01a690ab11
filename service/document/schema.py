"""The JSON Schema of what a person writes, with the hints that the editor builds its controls from."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema
from pydantic_core.core_schema import ModelSchema, TaggedUnionSchema, WithDefaultSchema

from service.document.base import field_names
from service.document.document import Scene
from service.document.settings import Settings
from service.document.texture import REFERENCE_TAG, VALUE_TAG


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
