"""The recipe in PNG, WebP and EXR files: scene, settings and view, enough to make the same picture again."""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib import metadata
from typing import Annotated, Any

from pydantic import Field, TypeAdapter

from service.document.base import Model
from service.document.grading import Lut, ToneMap
from service.document.quality import ResolvedSettings
from service.document.validation import validated
from service.problems import FieldError, InvalidDocument
from service.views import DEFAULT_TONE_MAP, LEAST_EXPOSURE, MOST_EXPOSURE, AovOrAll, Bits, ColorSpace


class PictureView(Model):
    """How a picture was written. Linear formats ignore exposure and tone map; "all" is every AOV as a layer."""

    aov: AovOrAll = "color"
    exposure: Annotated[float, Field(ge=LEAST_EXPOSURE, le=MOST_EXPOSURE)] = 0.0
    tone_map: ToneMap = DEFAULT_TONE_MAP
    bits: Bits = 8
    color_space: ColorSpace = "srgb"
    lut: Lut = None


RARE = {"color_space": "srgb", "lut": None}  # fields that are written where they differ from this


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
        "sunbox": metadata.version("sunbox-server"),
        "scene": scene,
        "settings": settings.again(samples),
        "samples": samples,
        "view": {name: value for name, value in view.model_dump().items() if value != RARE.get(name)},
    }
    return written | {"assets": assets} if assets else written


def write_text(scene: str, settings: ResolvedSettings, samples: int, view: PictureView) -> str:
    """The metadata as JSON, for a scene that is JSON already: parsing one of 30 MB takes seconds."""
    before, after = json.dumps(write(None, settings, samples, view), separators=(",", ":")).split('"scene":null', 1)
    return f'{before}"scene":{scene}{after}'


def read(document: Any) -> Recipe:
    """Parse the metadata. Raises InvalidDocument with pointers from its root."""
    if isinstance(document, dict) and "scene" not in document:
        raise InvalidDocument([FieldError("/scene", "is not there: an older Sunbox made this picture")])
    found = validated(_RECIPE, document, "")
    return Recipe(found.scene, found.settings, found.view, found.assets)
