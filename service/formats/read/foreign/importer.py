"""A file that a library reads as a scene document, by the one glTF reader."""

from __future__ import annotations

from dataclasses import replace

from service.formats.read.archive import Archive
from service.formats.read.foreign import assimp, cad, three_mf
from service.formats.read.foreign.glb import Find, Glb
from service.formats.read.gltf.importer import read_scene
from service.formats.read.gltf.merged_mesh import read_merged
from service.formats.read.raw_mesh import RawMesh
from service.formats.types import AssetLimits, Pose, SceneFile


def read_foreign_scene(
    format: str, data: memoryview, limits: AssetLimits, pose: Pose | None = None, find: Find = lambda name: None
) -> SceneFile:
    """The scene. `find` gives the files beside it, by the names that it has for them. Raises ParseError,
    MissingExtra."""
    file = _converted(format, data, limits, find)
    found = read_scene(file.written(), limits, pose)
    notes = [{"pointer": "", "detail": detail} for detail in dict.fromkeys(file.warnings)]
    return replace(found, warnings=[*notes, *found.warnings])


def read_zipped_foreign(
    archive: Archive, path: str, format: str, limits: AssetLimits, pose: Pose | None = None
) -> SceneFile:
    """The scene of the file at this path of a zip, with the images there. Raises ParseError, MissingExtra."""
    remarks = dict[str, None]()

    def find(name: str) -> bytes | None:
        found = archive.finder.find(path, name)
        if found is None:
            return None
        remarks.update({found.remark: None} if found.remark else {})
        return archive.read(found.path)

    scene = read_foreign_scene(format, memoryview(archive.read(path)), limits, pose, find)
    notes = [{"pointer": path.rpartition("/")[2][:300], "detail": detail} for detail in remarks]
    return replace(scene, warnings=[*notes, *scene.warnings])


def read_foreign_mesh(format: str, data: memoryview, limits: AssetLimits) -> RawMesh:
    """All its triangles as one mesh. Raises ParseError, MissingExtra."""
    return read_merged(_converted(format, data, limits, lambda name: None).written(), limits)


def _converted(format: str, data: memoryview, limits: AssetLimits, find: Find) -> Glb:
    if format == "3mf":
        return three_mf.converted(bytes(data), limits)
    return cad.converted(bytes(data)) if format == "step" else assimp.converted(format, bytes(data), find)
