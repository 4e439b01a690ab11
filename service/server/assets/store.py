"""Uploaded assets, named by the hash of their bytes, in a folder that survives a restart."""

import hashlib
import json
import logging
import os
import re
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import asdict, replace
from pathlib import Path
from typing import BinaryIO

from service.formats.cache import Parsed, ParsedCache, as_image, as_measured, as_mesh, describe, layered, refused
from service.formats.errors import ParseError
from service.formats.formats import KINDS, sniff
from service.formats.read.scenes.plain_mesh import plain_scene
from service.formats.scene_import import Imported, take_apart
from service.formats.source import Source, digest, for_sandbox, format_of, length, unreadable
from service.formats.types import (
    AssetInfo,
    HasLimits,
    ImageData,
    Kind,
    MeasuredData,
    MeshData,
    SceneFile,
    ScenePart,
    asset_limits,
)
from service.problems import AssetError, NotFound, Unavailable, UnsupportedMedia
from service.server.assets.entries import taken
from service.server.assets.folder import DAMAGED, RECORD, SCENE, AssetFolder
from service.server.assets.integrity import Integrity, damaged
from service.system.confined import Rights
from service.system.disk_usage import Usage, expected
from service.system.garbage import collector_paused

log = logging.getLogger(__name__)

ID = re.compile(r"sha256:[0-9a-f]{64}")
FORMATS = (
    "OBJ, PLY, STL, glTF and GLB meshes; USD; MaterialX; FBX, COLLADA, 3DS, X3D, 3MF and STEP; ZIP archives of one "
    "of these with its parts, or of images that make materials by their names; EXR, Radiance HDR, PNG, JPEG and WebP "
    "images; .cube tables of colours; measured reflection as MERL .binary and RGL .bsdf files"
)
NO_SCENES: dict[Kind, str] = {
    "image": "is an image",
    "materials": "holds materials",
    "lut": "is a table of colours",
    "measured": "is measured reflection",
}
TAKEN_APART: tuple[Kind, ...] = ("scene", "materials")  # kinds of files whose parts are assets of their own
RECORD_BYTES = 512  # about the size of an asset's record

Room = Callable[[Usage], AbstractContextManager[None]]


class AssetStore:
    """For any number of threads, and for several processes on one folder.

    `builtin` returns built-in assets by id; it is called when one of them is first requested.
    `room` is a context for storing files: it is called with their disk space, and raises where that is too much.
    """

    def __init__(
        self,
        root: Path,
        config: HasLimits | None = None,
        builtin: Callable[[], dict[str, bytes]] | None = None,
        room: Room = lambda size: nullcontext(),
    ) -> None:
        self.loader = ParsedCache(asset_limits(config))
        self._files = AssetFolder(root / "assets")
        self._integrity = Integrity(self._files)
        self._builtin = builtin
        self.room = room

    def incoming(self) -> BinaryIO:
        """A file without a name for an upload, deleted when it is closed. Raises Unavailable."""
        with self._storing("new"):
            return self._files.nameless()

    def receive(self, file: BinaryIO, more: bytes) -> None:
        """Append to an upload. Raises Unavailable where the disk is full."""
        with self._storing("new"):
            file.write(more)
            file.flush()

    def add(
        self,
        data: Source,
        content_type: str | None = None,
        filename: str | None = None,
        room: Room | None = None,
        title: str | None = None,
        entry: str | None = None,
    ) -> AssetInfo:
        """Parse the bytes, and store them; they replace damaged ones of the same id.

        `room` is used instead of the store's own; errors call a scene's file `title`. With `entry` the asset is that
        model of a zip, without all that is no part of it. Raises UnsupportedMedia, AssetError, Unavailable, and the
        exceptions of `room`.
        """
        if entry is not None:
            filename, data = taken(self.loader.sandbox, data, entry, content_type, filename, title)
            content_type = None
        id, size = "sha256:" + digest(data), length(data)
        known = self._known(id)
        if (
            known is not None
            and self._is_sound(id, again=True)
            and (known.kind not in TAKEN_APART or self._imported(id, again=True))
        ):
            return known
        if not size:
            raise AssetError("the asset is empty")
        format = format_of(data, content_type, filename)
        if format is None:
            raise UnsupportedMedia(
                unreadable(data, filename) or f"the format is not supported; supported are {FORMATS}"
            )
        if KINDS[format] in TAKEN_APART:
            return self._import(id, format, data, True, room, title)[0]
        info = self._described(id, format, data)
        with (room or self.room)(expected((size, RECORD_BYTES))):
            self._store(info, data)
        return info

    def scene(self, id: str) -> Imported:
        """A glTF file, a zipped model or a mesh as a document whose references are assets here.

        Raises NotFound, AssetError, Unavailable.
        """
        info = self.info(id)
        # An older version recorded some zips of models as materials.
        if info.kind == "materials" and (imported := self.materials(id)).kind == "scene":
            return imported
        if info.kind in NO_SCENES:
            what = NO_SCENES[info.kind]
            raise NotFound(f"{id[:100]} {what}: only meshes and scene files can be shown as a scene")
        if info.kind == "mesh":
            # It stays parsed, however large it is, until the scene is packed.
            document, remark = plain_scene(id, as_mesh(self.load(id, ahead=True), id))
            said = [] if remark is None else [{"pointer": "", "detail": remark}]
            return Imported(document, [*said, *(info.warnings or ())], lit=False)
        return self.materials(id)

    def materials(self, id: str) -> Imported:
        """A zip of images, or a scene's file, as a document, which has materials and their textures.

        Raises NotFound, AssetError, Unavailable.
        """
        info = self.info(id)
        if info.kind not in TAKEN_APART:
            raise NotFound(f"{id[:100]} is {'an' if info.kind == 'image' else 'a'} {info.kind} and has no materials")
        imported = self._imported(info.id)
        if imported is None:
            with self.opened(info.id) as source:
                imported = self._import(info.id, info.format, source, False)[1]
        return imported

    def parts(self, info: AssetInfo) -> list[str]:
        """The id of an asset and, for a scene, those of the assets that it was imported as."""
        imported = self._imported(info.id) if info.kind in TAKEN_APART else None
        return [info.id, *(imported.references() if imported else ())]

    def read(self, id: str) -> bytes:
        """An asset's bytes. Raises NotFound."""
        with self.opened(id) as source:
            return source if isinstance(source, bytes) else source.read()

    @contextmanager
    def opened(self, id: str, again: bool = False) -> Iterator[bytes | BinaryIO]:
        """An asset's bytes, checked as `Integrity.open` does. Raises NotFound, for damaged bytes as well."""
        file = self._integrity.open(id, again) if self._known(id) is not None else None
        if file is None:
            yield self._builtin_bytes(id)
        else:
            with file:
                yield file

    def holds(self, id: str) -> bool:
        return self._known(id) is not None or self.is_builtin(id)

    def is_builtin(self, id: str) -> bool:
        return self._builtin is not None and id in self._builtin()

    def missing(self, id: str) -> str | None:
        """The reason why there is no such asset, or None if there is one."""
        if self.holds(id):
            return None
        try:
            self._builtin_bytes(id)
        except NotFound as error:
            return error.detail
        return None

    def info(self, id: str) -> AssetInfo:
        """The record of an asset. Raises NotFound."""
        known = self._known(id)
        if known:
            return known
        data = self._builtin_bytes(id)
        return self._described(id, _format(data), data)

    def mesh(self, ref: str) -> MeshData:
        """A mesh by its reference. Raises AssetError."""
        return as_mesh(self.load(ref), ref)

    def image(self, ref: str, layer: str = "") -> ImageData:
        """An image by its reference, of an EXR the layer of a name. Raises AssetError."""
        return as_image(self.load(ref, layer=layer), ref)

    def measured(self, ref: str) -> MeasuredData:
        """Measured reflection by its reference. Raises AssetError."""
        return as_measured(self.load(ref), ref)

    def start(self) -> None:
        """Start a parsing process, without waiting, so that a first file is parsed at once."""
        self.loader.sandbox.start()

    def rights(self) -> Rights:
        """The rights that the processes that parse uploads have given up. Waits for the first of them."""
        return self.loader.sandbox.rights()

    def close(self) -> None:
        self.loader.close()

    @collector_paused()
    def _import(
        self, id: str, format: str, data: Source, new: bool, room: Room | None = None, title: str | None = None
    ) -> tuple[AssetInfo, Imported]:
        """Store the parts of a scene and its document, and the file itself if it is `new`."""
        try:
            file = self.loader.sandbox.parse_scene(format, for_sandbox(data))
        except ParseError as error:
            raise refused(title or f"the {format.upper()} file", error) from None
        size = length(data)
        # References to the parts, which are about as long as a record, are added to the document.
        text = len(json.dumps(file.document)) + RECORD_BYTES * len(file.document["shapes"])
        with (room or self.room)(expected([text, *sizes_of_parts(file), *((size, RECORD_BYTES) if new else ())])):
            imported = take_apart(file, self.store_part)
            info = AssetInfo(
                id, imported.kind, format, size, triangles=file.triangles or None, warnings=imported.warnings or None,
                exposure=imported.exposure, aspect_ratio=imported.aspect_ratio, bounds=file.bounds,
            )  # fmt: skip
            info = with_choices(info, imported)
            if new:
                self._store(info, data, imported)
            else:
                with self._storing(id):
                    self._files.put(id, {SCENE: imported.written()})
        return info, imported

    def store_part(self, part: ScenePart) -> str:
        """The id of a part of a scene, stored as an asset of its own.

        It does not wait for the disk, which takes 15 ms a part: scenes have thousands, and can be imported again.
        Raises AssetError, UnsupportedMedia, Unavailable.
        """
        id = "sha256:" + hashlib.sha256(part.data).hexdigest()
        if self._is_sound(id):
            return id
        if part.triangles is not None:
            info = AssetInfo(
                id,
                "mesh",
                "ply",
                len(part.data),
                vertices=part.vertices,
                triangles=part.triangles,
                bounds=part.bounds,
            )
        else:
            format = format_of(part.data)
            if format is None:
                raise UnsupportedMedia(f"{part.pointer}: the format is not supported; supported are {FORMATS}")
            info = self._described(id, format, part.data)
        self._store(info, part.data, lasting=False)
        return id

    def _imported(self, id: str, again: bool = False) -> Imported | None:
        """The document that a scene was imported as; None where some of it is missing. `again` as for `opened`."""
        try:
            imported = Imported.read(self._files.file(id, SCENE).read_bytes())
        except (OSError, ValueError):
            return None
        sound = [
            self._is_sound(reference, again) for reference in imported.references()
        ]  # of all of them, so that all that is damaged is found
        return imported if all(sound) else None

    def _store(self, info: AssetInfo, data: Source, scene: Imported | None = None, lasting: bool = True) -> None:
        files: dict[str, Source] = {"": data}
        if scene is not None:
            files[SCENE] = scene.written()
        files[RECORD] = json.dumps(asdict(info)).encode()
        with self._storing(info.id):
            changed = self._files.put(info.id, files, lasting)
        self._integrity.stored(info.id, changed)
        log.info("asset stored", {"id": info.id, "format": info.format, "bytes": info.bytes})

    @contextmanager
    def _storing(self, id: str) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            log.error("could not store an asset", {"id": id, "error": error})
            raise Unavailable(f"the asset could not be stored: {os.strerror(error.errno or 0)}") from None

    def load(self, ref: str, ahead: bool = False, layer: str = "") -> Parsed:
        """An asset of any kind by its reference; `ahead` as ParsedCache.load has it. Raises AssetError."""
        if not ID.fullmatch(ref):
            raise AssetError(f"{ref[:100]!r} is not the id of an asset, `sha256:` and 64 hexadecimal digits")
        known = self._known(ref)
        try:
            format = known.format if known else _format(self._builtin_bytes(ref))
            return self._parse(ref, format, lambda: self.opened(ref), ahead, layer)
        except NotFound as error:
            raise AssetError(error.detail) from None

    def _parse(
        self,
        id: str,
        format: str,
        opened: Callable[[], AbstractContextManager[Source]],
        ahead: bool = False,
        layer: str = "",
    ) -> Parsed:
        def parse() -> Parsed:
            with opened() as source:
                return self.loader.sandbox.parse(format, for_sandbox(source), layer)

        try:
            return self.loader.load(layered(id, layer), parse, ahead)
        except ParseError as error:
            raise refused(f"the {format.upper()} file", error) from None

    def _described(self, id: str, format: str, data: Source) -> AssetInfo:
        """The record of a mesh or an image, which stays parsed for its first scene. Raises AssetError."""
        return describe(id, format, length(data), self._parse(id, format, lambda: nullcontext(data), ahead=True))

    def _is_sound(self, id: str, again: bool = False) -> bool:
        try:
            with self.opened(id, again):
                return True
        except NotFound:
            return False

    def _known(self, id: str) -> AssetInfo | None:
        """The record beside the bytes; it is written last, so that the bytes are complete where it exists."""
        if not ID.fullmatch(id):
            return None
        try:
            info = AssetInfo(**json.loads(self._files.file(id, RECORD).read_bytes()))
            if self._files.file(id).stat().st_size != info.bytes:
                return None  # the power failed before all of it was on the disk
            if info.kind == "materials":
                return info
            return replace(info, kind=KINDS[info.format])  # an older version recorded glTF files as meshes
        except (OSError, ValueError, TypeError, KeyError):
            return None

    def _builtin_bytes(self, id: str) -> bytes:
        found = self._builtin().get(id) if self._builtin and ID.fullmatch(id) else None
        if found is None:
            if ID.fullmatch(id) and self._files.file(id, DAMAGED).exists():
                raise damaged(id)
            raise unknown(id)
        return found


def sizes_of_parts(file: SceneFile) -> list[int]:
    """The bytes that the parts of a scene take on the disk."""
    return [stored for part in file.parts for stored in (len(part.data), RECORD_BYTES)]


def with_choices(info: AssetInfo, imported: Imported) -> AssetInfo:
    return replace(info, variants=imported.variants or None, animations=imported.animations or None)


def unknown(id: str) -> NotFound:
    return NotFound(f"there is no asset {id[:100]!r} here; upload it first")


def _format(data: bytes) -> str:
    """The format of a built-in asset, by its bytes."""
    return sniff(data) or "obj"
