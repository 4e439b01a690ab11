"""The scene document as a whole."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationError

from service.problems import FieldError, InvalidDocument
from service.scene.base import OMITTABLE, Model, hint, refusal
from service.scene.camera import Camera
from service.scene.environment import Environment
from service.scene.light import Light
from service.scene.material import Material
from service.scene.mistakes import MOST, among, escaped, mistakes
from service.scene.numbers import described
from service.scene.shape import Shape
from service.scene.texture import Texture


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
    materials: Annotated[dict[str, Material], hint("Materials", "By names of your choice.")]
    shapes: Annotated[list[Shape], hint("Shapes", "Each made of one of the materials.")]


def parse_scene(document: Any, pointer: str = "") -> Scene:
    """The scene that a document describes. Raises InvalidDocument with every mistake, seen from `pointer` up."""
    errors: list[FieldError] = []
    try:
        scene = Scene.model_validate(document)
    except ValidationError as error:
        errors = mistakes(error, Scene)
    errors += islice(_dangling(document), MOST)
    if errors:
        raise InvalidDocument(errors).under(pointer)
    return scene


def _dangling(document: Any) -> Iterator[FieldError]:
    """Names of what is not there; looked for in the raw document, so that other mistakes don't hide them."""
    if not isinstance(document, dict):
        return
    materials, shapes, textures = (document.get(key) for key in ("materials", "shapes", "textures"))
    if isinstance(materials, dict):
        if isinstance(textures, dict) or "textures" not in document:
            yield from _textureless(materials, textures or {})
        if isinstance(shapes, list):
            yield from _immaterial(shapes, materials)


def _immaterial(shapes: list[Any], materials: dict[str, Any]) -> Iterator[FieldError]:
    for i, shape in enumerate(shapes):
        name = shape.get("material") if isinstance(shape, dict) else None
        if isinstance(name, str) and name not in materials:
            yield FieldError(
                f"/shapes/{i}/material", f"there is no material named {name[:80]!r}; the scene has {among(materials)}"
            )


def _textureless(materials: dict[str, Any], textures: dict[str, Any]) -> Iterator[FieldError]:
    for key, material in materials.items():
        for field, value in material.items() if isinstance(material, dict) else ():
            name = value.get("texture") if isinstance(value, dict) else None
            if isinstance(name, str) and name not in textures:
                yield FieldError(
                    f"/materials/{escaped(key)}/{escaped(field)}/texture",
                    f"there is no texture named {name[:80]!r}; the scene has {among(textures)}",
                )
