"""What a zip holds as a scene's document, as one mesh, or as a file of its own with its parts alone."""

from __future__ import annotations

import posixpath
from dataclasses import replace
from importlib.util import find_spec
from types import ModuleType

from service.formats.errors import MissingExtra, NoTriangles, ParseError
from service.formats.formats import FOREIGN, PACKAGES, text
from service.formats.read.archive import Archive, listed, zipped
from service.formats.read.gltf.importer import read_zipped_scene
from service.formats.read.gltf.merged_mesh import read_zipped_merged
from service.formats.read.materialx.importer import read_materialx
from service.formats.read.obj.importer import read_obj_scene, read_ply_scene
from service.formats.read.obj_mesh import read_obj
from service.formats.read.raw_mesh import RawMesh
from service.formats.read.texture_sets.importer import read_texture_sets
from service.formats.read.usd_names import may_show
from service.formats.read.zips.contents import MATERIALX, PACKAGE, Contents, chosen, contents_of, nothing
from service.formats.read.zips.meshes import read_stl_scene, read_zipped_mesh
from service.formats.types import AssetLimits, Pose, SceneFile

MOST_NAMED = 10  # files in a warning


def read_zip(
    data: bytes | memoryview, limits: AssetLimits, pose: Pose | None = None, entry: str | None = None
) -> SceneFile:
    """The scene or the materials in a zip; a glTF file perhaps in a pose, and of several models that which `entry`
    names. Files that are not taken are told. Raises ParseError."""
    archive = Archive(data, limits.max_file)
    found = _contents(archive)
    path = chosen(found, entry)
    try:
        return _read(archive, found, path, limits, pose)
    except NoTriangles:
        if entry is not None or path is None:
            raise
        return _beside(archive, found, path, limits)
    except MissingExtra as missing:
        if entry is not None or path is None or found.models.get(path) != "usd" or may_show(archive.read(path)):
            raise
        try:
            return _beside(archive, found, path, limits)
        except NoTriangles:
            raise missing from None


def read_zip_as_mesh(data: bytes | memoryview, limits: AssetLimits) -> RawMesh:
    """The triangles of the model in a zip as one mesh, without its materials. Raises ParseError."""
    archive = Archive(data, limits.max_file)
    found = _contents(archive)
    path = chosen(found, None)
    if path is None:
        raise ParseError(nothing(archive, found))
    format = found.models[path]
    if format == "obj":
        return read_obj(text(archive.read(path)))
    if format == "usd":
        usd = usd_importer()
        if _is_package(path):
            return usd.read_merged(archive.read(path), limits)  # type: ignore[no-any-return]
        return usd.read_zipped_merged(archive, path, limits)  # type: ignore[no-any-return]
    if format in ("gltf", "glb"):
        return read_zipped_merged(archive, path, limits)
    if format in FOREIGN:
        from service.formats.read.foreign.importer import read_foreign_mesh

        return read_foreign_mesh(format, memoryview(archive.read(path)), limits)
    return read_zipped_mesh(archive, path, format, limits)


def taken(data: bytes | memoryview, limits: AssetLimits, entry: str) -> tuple[str, bytes]:
    """The model that `entry` names as a file of its own, and that file's name: a zip where the model has parts.

    Raises ParseError.
    """
    archive = Archive(data, limits.max_file)
    found = _contents(archive)
    path = chosen(found, entry)
    assert path is not None  # as an entry was asked for
    _read(archive, found, path, limits, None)
    if archive.used == {path}:
        return posixpath.basename(path), archive.read(path)
    return "model.zip", zipped({name: archive.read(name) for name in archive.used})


def usd_importer() -> ModuleType:
    """The module that reads USD. Raises MissingExtra."""
    package, module = PACKAGES["usd"]
    if find_spec(module) is None:
        raise MissingExtra(f"USD files need {package} on the server")
    from service.formats.read.usd import importer

    return importer


def _contents(archive: Archive) -> Contents:
    """The contents of a zip; of USD layers that refer to each other the first ones."""
    found = contents_of(archive)
    layers = [name for name, format in found.models.items() if format == "usd"]
    if len(layers) > 1:
        usd_importer()
        from service.formats.read.usd.package import root_layers

        roots = root_layers(archive, layers)
        found.models = {name: format for name, format in found.models.items() if name not in layers or name in roots}
    return found


def _is_package(path: str) -> bool:
    return path.lower().endswith(PACKAGE)


def _read(archive: Archive, found: Contents, path: str | None, limits: AssetLimits, pose: Pose | None) -> SceneFile:
    if path is None and not found.materials:
        return read_texture_sets(archive, limits, nothing(archive, found))
    format = MATERIALX if path is None else found.models.get(path, MATERIALX)
    if format == MATERIALX:
        sources = found.materials if path is None else [path]
        try:
            scene = read_materialx(sources, archive.finder, archive.read, limits)
        except MissingExtra as missing:
            try:
                return read_texture_sets(archive, limits, "")  # its names may say as much
            except ParseError:
                raise missing from None
        return _told(scene, archive, found, "the materials")
    assert path is not None
    scene = _model(archive, path, format, limits, pose)
    return _told(scene, archive, found, path)


def _beside(archive: Archive, found: Contents, path: str, limits: AssetLimits) -> SceneFile:
    """The materials beside a model without a mesh, as libraries of materials have it. Raises ParseError: NoTriangles
    where there are none."""
    del found.models[path]
    archive.used.clear()
    try:
        return _read(archive, found, None, limits, None)
    except MissingExtra:
        raise
    except ParseError:
        raise NoTriangles("the scene has no triangles: none of its nodes has a mesh", path[:100]) from None


def _model(archive: Archive, path: str, format: str, limits: AssetLimits, pose: Pose | None) -> SceneFile:
    if format in ("gltf", "glb"):
        return read_zipped_scene(archive, path, limits, pose)
    if format == "obj":
        return read_obj_scene(archive, path, limits)
    if format == "usd":
        usd = usd_importer()
        if _is_package(path):
            return usd.read_scene(archive.read(path), limits)  # type: ignore[no-any-return]
        return usd.read_zipped_scene(archive, path, limits)  # type: ignore[no-any-return]
    if format in FOREIGN:
        from service.formats.read.foreign.importer import read_zipped_foreign

        return read_zipped_foreign(archive, path, format, limits, pose)
    return read_ply_scene(archive, path, limits) if format == "ply" else read_stl_scene(archive, path, limits)


def _told(scene: SceneFile, archive: Archive, found: Contents, taken: str) -> SceneFile:
    """The scene, with a warning that names the files of the zip that are no part of it."""
    others = [name for name in archive.names if name not in archive.used]
    if not others:
        return scene
    who = taken if taken == "the materials" else repr(taken.rpartition("/")[2][:60])
    detail = f"{listed(others, MOST_NAMED)} of the zip {'are' if len(others) > 1 else 'is'} not used by {who}"
    if found.zips:
        detail += "; a zip within a zip is not opened"
    return replace(scene, warnings=[*scene.warnings, {"pointer": others[0][:300], "detail": detail}])
