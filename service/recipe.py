"""What a picture was made from, as PNG and EXR files carry it: enough to make the same picture again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import metadata
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter

from service.problems import FieldError, InvalidDocument
from service.quality import ResolvedSettings
from service.scene.base import Model
from service.scene.mistakes import validated

Aov = Literal["color", "albedo", "normal", "depth", "variance", "shape_id", "material_id", "all"]


class PictureView(Model):
    """How it was written. Linear formats take no notice of exposure and tone map, "all" is every AOV as a layer."""

    aov: Aov = "color"
    exposure: Annotated[float, Field(ge=-60, le=60)] = 0.0
    tone_map: Literal["linear", "exponential", "reinhard", "aces", "agx", "pbr_neutral"] = "pbr_neutral"
    bits: Literal[8, 16] = 8


class _Recipe(Model):
    sunbox: str
    scene: Any
    settings: dict[str, Any]
    samples: int
    view: PictureView
    assets: dict[str, str] = Field(default_factory=dict)


_RECIPE = TypeAdapter(_Recipe)


@dataclass(frozen=True)
class Recipe:
    """`scene` and `settings` are documents; `assets` are the names that files had, by the id that the scene uses."""

    scene: Any
    settings: dict[str, Any]
    view: PictureView
    assets: dict[str, str]


def write(
    scene: Any, settings: ResolvedSettings, samples: int, view: PictureView, assets: dict[str, str] | None = None
) -> dict[str, Any]:
    """The metadata of a picture of `samples` samples. `scene` refers to assets by id alone."""
    written: dict[str, Any] = {
        "sunbox": metadata.version("sunbox"),
        "scene": scene,
        "settings": settings.again(samples),
        "samples": samples,
        "view": view.model_dump(),
    }
    return written | {"assets": assets} if assets else written


def read(document: Any) -> Recipe:
    """Raises InvalidDocument with pointers from the metadata's root."""
    if isinstance(document, dict) and "scene" not in document:
        raise InvalidDocument([FieldError("/scene", "is not there: an older Sunbox made this picture")])
    found = validated(_RECIPE, document, "")
    return Recipe(found.scene, found.settings, found.view, found.assets)


def references(scene: Any) -> list[str]:
    """Every asset that a document (valid or not) refers to, once, in order."""
    found: dict[str, None] = {}

    def note(ref: str) -> str:
        found[ref] = None
        return ref

    renamed(scene, note)
    return list(found)


def renamed(scene: Any, name: Callable[[str], str]) -> Any:
    """The document with other names for its assets; the rest is shared with the one given."""
    if not isinstance(scene, dict):
        return scene
    out = dict(scene)
    if "environment" in scene:
        out["environment"] = _renamed(scene["environment"], name)
    if isinstance(scene.get("textures"), dict):
        out["textures"] = {key: _renamed(texture, name) for key, texture in scene["textures"].items()}
    if isinstance(scene.get("shapes"), list):
        out["shapes"] = [_renamed(shape, name) for shape in scene["shapes"]]
    return out


def _renamed(holder: Any, name: Callable[[str], str]) -> Any:
    if not isinstance(holder, dict):
        return holder
    out = dict(holder)
    if isinstance(out.get("asset"), str):
        out["asset"] = name(out["asset"])
    if isinstance(out.get("assets"), dict):
        out["assets"] = {key: name(ref) if isinstance(ref, str) else ref for key, ref in out["assets"].items()}
    return out
