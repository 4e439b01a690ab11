"""A material as users save it: bare, or together with the textures that it shows."""

from __future__ import annotations

from itertools import chain, islice
from typing import Annotated, Any

from pydantic import Field, TypeAdapter

from service.document.base import MOST_MISTAKES, Model, hint
from service.document.document import Limits, chained, textureless, too_many
from service.document.material import Material
from service.document.texture import Texture
from service.document.validation import validated, validated_entries
from service.problems import FieldError, InvalidDocument

_BARE: TypeAdapter[Any] = TypeAdapter(Material)


class SavedMaterial(Model):
    """A material with the textures that it shows, as a scene has both."""

    materials: Annotated[dict[str, Material], hint("Material", "One, by the name that it had in its scene.")] = Field(
        min_length=1, max_length=1
    )
    textures: Annotated[dict[str, Texture], hint("Textures", "All that it shows, by name.")] = Field(
        default_factory=dict
    )


_SET: TypeAdapter[SavedMaterial] = TypeAdapter(SavedMaterial)
_TEXTURE: TypeAdapter[Any] = TypeAdapter(Texture)
_NOT_ONE = FieldError("/materials", "must be an object with exactly one material, by its name")


def check_saved_material(document: Any, limits: Limits | None = None) -> None:
    """Raises InvalidDocument with the mistakes in a document, which is a bare Material or a SavedMaterial."""
    if not isinstance(document, dict) or "type" in document or "materials" not in document:
        validated(_BARE, document, "")
        return
    materials, textures = document["materials"], document.get("textures", {})
    errors = [] if isinstance(materials, dict) and len(materials) == 1 else [_NOT_ONE]
    if isinstance(textures, dict):
        errors += too_many({"textures": textures}, limits)
    if errors:
        raise InvalidDocument(errors)
    validated(_SET, {**document, "textures": {}} if isinstance(textures, dict) else document, "")
    _, errors = validated_entries(_TEXTURE, textures.items(), lambda name, texture: None)
    errors = [FieldError(f"/textures{error.pointer}", error.detail) for error in errors]
    errors += islice(chain(chained(textures), textureless(materials, textures)), MOST_MISTAKES)
    if errors:
        raise InvalidDocument(errors[:MOST_MISTAKES])
