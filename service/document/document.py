"""The scene document as a whole; and a material as users save it: bare, or with the textures that it shows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, islice
from typing import Annotated, Any, Literal, Protocol

from pydantic import BeforeValidator, Field, TypeAdapter, ValidationError

from service.document.base import MOST_MISTAKES, OMITTABLE, Model, hint, refusal
from service.document.camera import Camera
from service.document.environment import Environment
from service.document.light import Light
from service.document.material import Material
from service.document.numbers import described
from service.document.shape import Shape
from service.document.texture import Texture
from service.document.validation import among, mistakes, validated, validated_entries
from service.problems import FieldError, InvalidDocument, escaped

_BARE: TypeAdapter[Any] = TypeAdapter(Material)


def _version(value: Any) -> Any:
    if type(value) is not int or value != 1:  # 1.0 and true equal 1 too
        raise refusal(f"must be 1, the only version there is, not {described(value)}")
    return value


class Scene(Model):
    """What is to be rendered: camera, light, materials and shapes."""

    version: Annotated[Literal[1], BeforeValidator(_version), hint("Version", "Of this format.")]
    camera: Annotated[Camera, hint("Camera", "From where, and through what lens.")]
    environment: Annotated[
        Environment | None, OMITTABLE, hint("Environment", "What surrounds the scene; without one it is black.")
    ] = None
    lights: Annotated[list[Light], hint("Lights", "Lights that are no shapes.")] = Field(default_factory=list)
    textures: Annotated[dict[str, Texture], hint("Textures", "By names of your choice.")] = Field(
        default_factory=dict
    )
    materials: Annotated[
        dict[str, Material], hint("Materials", "By names of your choice.", new={"type": "principled"})
    ]
    shapes: Annotated[list[Shape], hint("Shapes", "Each made of one of the materials.")]


_KINDS: dict[str, type] = {"lights": list, "textures": dict, "materials": dict, "shapes": list}
_ENTRIES: dict[str, TypeAdapter[Any]] = {
    "lights": TypeAdapter(Light),
    "textures": TypeAdapter(Texture),
    "materials": TypeAdapter(Material),
    "shapes": TypeAdapter(Shape),
}


class Limits(Protocol):
    """The part of the service's configuration that bounds a scene."""

    @property
    def max_shapes(self) -> int: ...

    @property
    def max_lights(self) -> int: ...

    @property
    def max_materials(self) -> int: ...

    @property
    def max_textures(self) -> int: ...


@dataclass(frozen=True)
class Parsed:
    """A document, and the scene that it describes."""

    document: Any
    scene: Scene


def parse_scene(
    document: Any, pointer: str = "", limits: Limits | None = None, before: Parsed | None = None
) -> Scene:
    """The scene that a document describes. Raises InvalidDocument with its mistakes, seen from `pointer` up.

    Entries that `document` shares with the one `before` (`merge_patch` copies only what it changes) are the same in
    both scenes, and are not validated again.
    """
    fields = document if isinstance(document, dict) else {}
    tables = {name: fields[name] for name, kind in _KINDS.items() if isinstance(fields.get(name), kind)}
    errors = too_many(tables, limits)
    if errors:  # its entries are not validated
        raise InvalidDocument(errors).under(pointer)
    # The scene's entries are validated one by one, and the rest of the scene without them.
    head = {**document, **{name: type(entries)() for name, entries in tables.items()}} if tables else document
    try:
        scene = Scene.model_validate(head)
    except ValidationError as error:
        errors = mistakes(error, Scene)
    parts = {name: _part(name, entries, before, errors) for name, entries in tables.items()}
    errors.sort(key=_place)
    errors += islice(_dangling(document), MOST_MISTAKES)
    if errors:
        raise InvalidDocument(errors[:MOST_MISTAKES]).under(pointer)
    scene = scene.model_copy(update=parts)
    errors = list(islice(_filled_twice(scene), MOST_MISTAKES))
    if errors:
        raise InvalidDocument(errors).under(pointer)
    return scene


def too_many(tables: dict[str, Any], limits: Limits | None) -> list[FieldError]:
    """Errors for lists and tables of a scene, by name, that have more entries than the limits allow."""
    most = {name: getattr(limits, f"max_{name}") for name in tables} if limits is not None else {}
    return [
        FieldError(f"/{name}", f"has {len(tables[name])} entries: at most {most[name]} (SUNBOX_MAX_{name.upper()})")
        for name in most
        if len(tables[name]) > most[name]
    ]


def _part(name: str, entries: Any, before: Parsed | None, errors: list[FieldError]) -> Any:
    """The validated entries; adds the mistakes in them to `errors`."""
    old: Any = None if before is None else before.document.get(name)
    made: Any = None if before is None else getattr(before.scene, name)
    if entries is old:
        return made

    def known(key: int | str, value: Any) -> Any:
        return made[key] if isinstance(old, dict) and key in old and old[key] is value else None

    pairs = entries.items() if isinstance(entries, dict) else enumerate(entries)
    fresh, found = validated_entries(_ENTRIES[name], pairs, known)
    errors += (FieldError(f"/{name}{error.pointer}", error.detail) for error in found)
    return fresh if isinstance(entries, dict) else list(fresh.values())


def _filled_twice(scene: Scene) -> Iterator[FieldError]:
    """Errors for media of shapes whose material says by itself what is under its surface."""
    filled = {name for name, material in scene.materials.items() if material.is_filled()}
    for i, shape in enumerate(scene.shapes if filled else ()):
        if shape.material in filled and getattr(shape, "medium", None) is not None:
            detail = f"the material {shape.material!r} has a medium of its own: a body has one of the two"
            yield FieldError(f"/shapes/{i}/medium", detail)


def _place(error: FieldError) -> int:
    """The position of the error's field in the scene; unknown fields come last."""
    first = error.pointer.split("/", 2)[1:2]
    return next((i for i, name in enumerate(Scene.model_fields) if [name] == first), len(Scene.model_fields))


def _dangling(document: Any) -> Iterator[FieldError]:
    """Errors for references to missing entries, searched in the raw document so that other mistakes do not hide
    them."""
    if not isinstance(document, dict):
        return
    materials, shapes, textures = (document.get(key) for key in ("materials", "shapes", "textures"))
    if isinstance(textures, dict):
        yield from chained(textures)
    if isinstance(materials, dict):
        if isinstance(textures, dict) or "textures" not in document:
            yield from textureless(materials, textures or {})
        if isinstance(shapes, list):
            yield from _immaterial(shapes, materials)


def _immaterial(shapes: list[Any], materials: dict[str, Any]) -> Iterator[FieldError]:
    for i, shape in enumerate(shapes):
        name = shape.get("material") if isinstance(shape, dict) else None
        if isinstance(name, str) and name not in materials:
            yield FieldError(
                f"/shapes/{i}/material", f"there is no material named {name[:80]!r}; the scene has {among(materials)}"
            )


def textureless(materials: dict[str, Any], textures: dict[str, Any]) -> Iterator[FieldError]:
    """Errors for references of raw materials to textures that do not exist."""
    for key, material in materials.items():
        for field, value in material.items() if isinstance(material, dict) else ():
            name = value.get("texture") if isinstance(value, dict) else None
            if isinstance(name, str) and name not in textures:
                yield FieldError(
                    f"/materials/{escaped(key)}/{escaped(field)}/texture",
                    f"there is no texture named {name[:80]!r}; there are {among(textures)}",
                )


def chained(textures: dict[str, Any]) -> Iterator[FieldError]:
    """Errors for raw ramps of textures that do not exist, or that are ramps themselves."""
    for key, texture in textures.items():
        given = texture.get("input") if isinstance(texture, dict) else None
        name = given.get("texture") if isinstance(given, dict) else None
        if not isinstance(name, str):
            continue
        pointer, other = f"/textures/{escaped(key)}/input/texture", textures.get(name)
        if name not in textures:
            yield FieldError(pointer, f"there is no texture named {name[:80]!r}; there are {among(textures)}")
        elif isinstance(other, dict) and other.get("type") == "ramp":
            yield FieldError(pointer, f"{name[:80]!r} is a ramp: the input may be an image, a checker or a noise")


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
