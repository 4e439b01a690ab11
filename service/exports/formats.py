"""The formats that scenes and materials are written in, a row for each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import PurePath

from service.document import Scene
from service.exports.writing import Exported, Files, Limits
from service.problems import FieldError, InvalidDocument, NotProvided

Writer = Callable[[Scene, Files, Limits], Exported]


@dataclass(frozen=True)
class Format:
    """`module` has `write_scene` where the format has scenes, and `write_material` where it has single materials.

    `write_scene(scene, files, limits)` raises InvalidDocument with pointers from the scene's root, and TooLarge.
    `write_material` takes a scene without shapes whose only material it is, with its textures. Neither runs on an
    event loop. Modules load when they are first used.
    """

    media_type: str
    ending: str
    module: str
    has_scenes: bool = False
    has_materials: bool = False
    package: str | None = None  # that it needs, by the name of its import
    extra: str = ""  # of sunbox-server, with which that package is installed

    @property
    def is_provided(self) -> bool:
        return self.package is None or find_spec(self.package) is not None

    @property
    def scene_writer(self) -> Writer:
        return self._writer("write_scene")

    @property
    def material_writer(self) -> Writer:
        return self._writer("write_material")

    def _writer(self, name: str) -> Writer:
        if not self.is_provided:
            what = f"This server does not write .{self.ending} files"
            raise NotProvided(f"{what}: it lacks the package {self.package} (sunbox-server[{self.extra}]).")
        writer: Writer = getattr(import_module(self.module), name)
        return writer


FORMATS: dict[str, Format] = {
    "glb": Format("model/gltf-binary", "glb", "service.exports.gltf.writer", has_scenes=True),
    "gltf": Format("model/gltf+json", "gltf", "service.exports.gltf.writer", has_materials=True),
    "mtlx": Format(
        "application/mtlx+xml", "mtlx", "service.exports.materialx.writer", has_scenes=True, has_materials=True
    ),
}


def scene_format(name: str, pointer: str = "/format") -> Format:
    """The format of that name. Raises InvalidDocument for one that has no scenes."""
    return _known(name, pointer, {key: each for key, each in FORMATS.items() if each.has_scenes})


def material_format(name: str, pointer: str = "format") -> Format:
    """The format of that name. Raises InvalidDocument for one that has no single materials."""
    return _known(name, pointer, {key: each for key, each in FORMATS.items() if each.has_materials})


def format_of_ending(path: str) -> str | None:
    """The name of the format of scenes that the ending of a file's name says."""
    ending = PurePath(path).suffix.lower().removeprefix(".")
    return next((name for name, each in FORMATS.items() if each.has_scenes and each.ending == ending), None)


def _known(name: str, pointer: str, formats: dict[str, Format]) -> Format:
    if name not in formats:
        raise InvalidDocument([FieldError(pointer, f"must be {' or '.join(formats)}, not {name[:40]!r}")])
    return formats[name]
