"""A scene's file taken apart: its meshes and images become assets, to which the document refers."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

from service.formats.types import Kind, Pose, SceneFile, ScenePart
from service.problems import AssetError, InvalidDocument, NotFound

IMPORTER = 11  # raised when files must be imported anew, because their documents or warnings change
PART = re.compile(r"part:(\d+)")
LOST = "lost"  # stands for the id of an image that can't be read


@dataclass(frozen=True)
class Imported:
    """A valid document, except that it may lack an environment; and warnings about unsupported parts of the file."""

    document: dict[str, Any]
    warnings: list[dict[str, Any]]
    lit: bool  # has lights of its own
    exposure: float | None = None  # in stops, that suits these lights; None: 0 does
    aspect_ratio: float | None = None  # of the picture of its camera, width over height
    importer: int = 0  # the IMPORTER that wrote it
    variants: list[str] = field(default_factory=list)  # of its materials, by name
    animations: list[dict[str, Any]] = field(default_factory=list)  # [{name, duration}], s
    bounds: list[list[float]] | None = None  # of its triangles where they stand: least and greatest x, y, z, m

    def check(self, pose: Pose) -> None:
        """Raise NotFound where the file does not have what a pose names."""
        from service.document.validation import among

        moves = [each["name"] for each in self.animations]
        for kind, name, known in (("variant", pose.variant, self.variants), ("animation", pose.animation, moves)):
            if name is not None and name not in known:
                there = f"it has {among(known)}" if known else f"the file has no {kind}s"
                raise NotFound(f"there is no {kind} {name[:100]!r}; {there}", f"/{kind}")

    @classmethod
    def read(cls, text: bytes) -> Imported:
        """Parse the text of `written`. Raises ValueError, also for a text of an older importer."""
        try:
            found = cls(**json.loads(text))
            found.references()
        except (TypeError, KeyError, AttributeError):
            raise ValueError("this is no record of an import") from None
        if found.importer != IMPORTER:
            raise ValueError(f"importer {found.importer} wrote this, and {IMPORTER} does now")
        return found

    def written(self) -> bytes:
        return json.dumps(vars(self)).encode()  # not asdict: it would copy the whole document

    def scene(self, environment: dict[str, Any]) -> dict[str, Any]:
        """The document; under `environment` where the file has no light."""
        return self.document if self.lit else {**self.document, "environment": environment}

    @property
    def kind(self) -> Kind:
        return "scene" if self.document["shapes"] else "materials"

    def references(self) -> set[str]:
        """The assets that the document needs."""
        parts = [
            *self.document["shapes"],
            *self.document.get("textures", {}).values(),
            self.document.get("environment", {}),
        ]
        return {one["asset"] for one in parts if "asset" in one}


def take_apart(file: SceneFile, store: Callable[[ScenePart], str]) -> Imported:
    """Store a scene's parts by `store`, which returns their ids. A model's images that can't be read are left out,
    with warnings. Raises AssetError, and what `store` raises."""
    from service.document import parse_scene  # a quarter of a second, which each parsing child would wait for, too

    ids: list[str] = []
    lost: list[dict[str, Any]] = []  # warnings about images
    for part in file.parts:
        try:
            ids.append(store(part))
        except AssetError as error:
            if part.triangles is not None or not file.document["shapes"]:
                raise AssetError(f"{part.pointer}: {error.detail}", part.pointer) from None
            lost.append({"pointer": part.pointer, "detail": f"{error.detail}; the image is left out"})
            ids.append(LOST)

    def renamed(one: dict[str, Any]) -> dict[str, Any]:
        if "asset" not in one:  # a shape or an environment that is in the document itself
            return one
        found = PART.fullmatch(str(one["asset"]))
        if found is None or int(found[1]) >= len(ids):
            raise AssetError("its parts can't be told apart")
        return {**one, "asset": ids[int(found[1])]}

    document = {
        **file.document,
        "textures": {name: renamed(one) for name, one in file.document.get("textures", {}).items()},
        "shapes": [renamed(one) for one in file.document["shapes"]],
    }
    if "environment" in document:
        document["environment"] = renamed(document["environment"])
    if lost:
        _leave_out(document)
    try:
        parse_scene(document)
    except InvalidDocument as error:
        raise AssetError(f"as a scene it has a mistake at {error.errors[0]}") from None
    animations = [asdict(each) for each in file.animations]
    return Imported(
        document, [*file.warnings, *lost], file.lit, file.exposure, file.aspect_ratio, IMPORTER, file.variants,
        animations, file.bounds,
    )  # fmt: skip


def _leave_out(document: dict[str, Any]) -> None:
    """Take the textures of lost images out of a document's materials, which show their factors instead, and a lost
    environment."""
    textures: dict[str, Any] = document["textures"]
    gone = {name for name, texture in textures.items() if texture.get("asset") == LOST}
    gone |= {name for name, texture in textures.items() if _shows(texture.get("input"), gone)}
    document["textures"] = {name: texture for name, texture in textures.items() if name not in gone}
    document["materials"] = {
        name: {
            field: value["factor"] if _shows(value, gone) else value
            for field, value in material.items()
            if not _shows(value, gone) or "factor" in value
        }
        for name, material in document.get("materials", {}).items()
    }
    if document.get("environment", {}).get("asset") == LOST:
        del document["environment"]


def _shows(value: Any, textures: set[str]) -> bool:
    return isinstance(value, dict) and value.get("texture") in textures
