"""A USD file as a scene or as triangles, where the extra that reads it is installed. Runs in the parsing process."""

from __future__ import annotations

from importlib.util import find_spec
from types import ModuleType

from service.formats.errors import MissingExtra
from service.formats.formats import PACKAGES
from service.formats.read.raw_mesh import RawMesh
from service.formats.types import AssetLimits, SceneFile


def read_usd_scene(data: memoryview, limits: AssetLimits) -> SceneFile:
    """Raises ParseError, MissingExtra."""
    found: SceneFile = _importer().read_scene(data, limits)
    return found


def read_usd_mesh(data: memoryview, limits: AssetLimits) -> RawMesh:
    """Raises ParseError, MissingExtra."""
    found: RawMesh = _importer().read_merged(data, limits)
    return found


def _importer() -> ModuleType:
    package, module = PACKAGES["usd"]
    if find_spec(module) is None:
        raise MissingExtra(f"USD files need {package} on the server")
    from service.formats.read.usd import importer

    return importer
