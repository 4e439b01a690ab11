"""The assets people uploaded, named by the hash of their bytes, in a folder that survives a restart."""

import hashlib
import json
import logging
import os
import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import BinaryIO, Protocol

import numpy as np

from service.assets.data import AssetInfo, AssetLimits, ImageData, MeshData, ScenePart
from service.assets.errors import ParseError
from service.assets.importing import Imported, take_apart
from service.assets.loader import Loader, Parsed, as_image, as_mesh, refused
from service.assets.sniff import KINDS, sniff
from service.assets.source import Source, digest, format_of, handed, length, write
from service.problems import AssetError, NotFound, Unavailable, UnsupportedMedia

log = logging.getLogger(__name__)

ID = re.compile(r"sha256:[0-9a-f]{64}")
SCENE = ".scene.json"  # of an asset that is one: its document
FORMATS = "OBJ, PLY, STL, glTF and GLB meshes; EXR, Radiance HDR, PNG, JPEG and WebP images"


class HasLimits(Protocol):
    """As much of the configuration as concerns assets."""

    @property
    def max_triangles(self) -> int: ...

    @property
    def max_texels(self) -> int: ...

    @property
    def max_asset(self) -> int: ...

    @property
    def parse_seconds(self) -> float: ...

    @property
    def parse_memory(self) -> int: ...


class AssetStore:
    """For any number of threads, and for several processes on one folder.

    `builtin` gives assets that are there without having been uploaded, by id; it is called when one is first missed.
    """

    def __init__(
        self,
        root: Path,
        config: HasLimits | None = None,
        builtin: Callable[[], dict[str, bytes]] | None = None,
    ) -> None:
        self.loader = Loader(_limits(config))
        self._folder = root / "assets"
        self._builtin = builtin

    def incoming(self) -> BinaryIO:
        """A file without a name, for an upload; gone when it is closed. Raises Unavailable."""
        with self._storing("new"):
            return tempfile.TemporaryFile(dir=self._folder)

    def receive(self, file: BinaryIO, more: bytes) -> None:
        """Raises Unavailable where the disk takes no more."""
        with self._storing("new"):
            file.write(more)
            file.flush()

    def add(self, data: Source, content_type: str | None = None, filename: str | None = None) -> AssetInfo:
        """Keeps the bytes, once they have been parsed. Raises UnsupportedMedia, AssetError, Unavailable."""
        id, size = "sha256:" + digest(data), length(data)
        known = self._known(id)
        if known is not None:
            return known
        if not size:
            raise AssetError("the asset is empty")
        format = format_of(data, content_type, filename)
        if format is None:
            raise UnsupportedMedia(f"this is none of the formats known: {FORMATS}")
        if KINDS[format] == "scene":
            info = self._import(id, format, data)
        else:
            info = _describe(id, format, size, self._parse(id, format, lambda: nullcontext(data)))
        self._store(info, data)
        return info

    def scene(self, id: str) -> Imported:
        """A glTF file as a document whose references are assets here. Raises NotFound, AssetError, Unavailable."""
        info = self.info(id)
        if info.kind != "scene":
            raise NotFound(f"{id[:100]} is no scene: it is {'an image' if info.kind == 'image' else 'a mesh'}")
        try:
            imported = Imported(**json.loads(self._path(id, SCENE).read_bytes()))
            if all(self._known(reference) for reference in imported.references()):
                return imported
        except (OSError, ValueError, TypeError):
            pass  # nothing of it is lost: the file itself is still here
        with self._opened(id) as source:
            self._import(id, info.format, source)
        return Imported(**json.loads(self._path(id, SCENE).read_bytes()))

    def read(self, id: str) -> bytes:
        """Raises NotFound."""
        with self._opened(id) as source:
            return source if isinstance(source, bytes) else source.read()

    def _opened(self, id: str) -> AbstractContextManager[bytes | BinaryIO]:
        """Raises NotFound."""
        if self._known(id):
            try:
                with suppress(OSError):
                    os.utime(self._path(id))  # who makes room goes by this
                return self._path(id).open("rb")
            except FileNotFoundError:  # to make room, just now
                pass
        return nullcontext(self._builtin_bytes(id))

    def holds(self, id: str) -> bool:
        return self._known(id) is not None or (self._builtin is not None and id in self._builtin())

    def info(self, id: str) -> AssetInfo:
        """Raises NotFound."""
        known = self._known(id)
        if known:
            return known
        data = self._builtin_bytes(id)
        format = _format(data)
        return _describe(id, format, len(data), self._parse(id, format, lambda: nullcontext(data)))

    def mesh(self, ref: str) -> MeshData:
        """Raises AssetError."""
        return as_mesh(self._load(ref), ref)

    def image(self, ref: str) -> ImageData:
        """Raises AssetError."""
        return as_image(self._load(ref), ref)

    def warm(self) -> None:
        """Makes the first file as quick as the later ones; does not wait."""
        self.loader.sandbox.warm()

    def close(self) -> None:
        self.loader.close()

    def _import(self, id: str, format: str, data: Source) -> AssetInfo:
        """Stores the parts of a scene and its document, not the file itself."""
        try:
            file = self.loader.sandbox.parse_scene(format, handed(data))
        except ParseError as error:
            raise refused(f"the {format.upper()} file", error) from None
        imported = take_apart(file, self._keep)
        with self._storing(id):
            self._write(self._path(id, SCENE), json.dumps(vars(imported)).encode())
        warnings = imported.warnings or None
        return AssetInfo(id, "scene", format, length(data), triangles=file.triangles, warnings=warnings)

    def _keep(self, part: ScenePart) -> str:
        """The id of a part of a scene, stored as an asset of its own."""
        id = "sha256:" + hashlib.sha256(part.data).hexdigest()
        if self._known(id) is None:
            if part.triangles is None:
                return self.add(bytes(part.data)).id
            info = AssetInfo(id, "mesh", "ply", len(part.data), vertices=part.vertices, triangles=part.triangles)
            self._store(info, part.data, lasting=False)
        return id

    def _store(self, info: AssetInfo, data: Source, lasting: bool = True) -> None:
        """Not `lasting`: what can be made again needs no wait for the disk, 15 ms a part; a scene has thousands."""
        with self._storing(info.id):
            self._write(self._path(info.id), data, lasting)
            self._write(self._path(info.id, ".json"), json.dumps(asdict(info)).encode(), lasting)
        log.info("asset stored id=%s format=%s bytes=%d", info.id, info.format, info.bytes)

    @contextmanager
    def _storing(self, id: str) -> Iterator[None]:
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            yield
        except OSError as error:
            log.error("could not store an asset id=%s error=%s", id, error)
            raise Unavailable(f"the asset could not be stored: {os.strerror(error.errno or 0)}") from None

    def _load(self, ref: str) -> Parsed:
        if not ID.fullmatch(ref):
            raise AssetError(f"{ref[:100]!r} is not the id of an asset, `sha256:` and 64 hexadecimal digits")
        known = self._known(ref)
        try:
            format = known.format if known else _format(self._builtin_bytes(ref))
        except NotFound as error:
            raise AssetError(error.detail) from None
        return self._parse(ref, format, lambda: self._opened(ref))

    def _parse(self, id: str, format: str, opened: Callable[[], AbstractContextManager[Source]]) -> Parsed:
        def parse() -> Parsed:
            with opened() as source:
                return self.loader.sandbox.parse(format, handed(source))

        try:
            return self.loader.load(id, parse)
        except ParseError as error:
            raise refused(f"the {format.upper()} file", error) from None

    def _known(self, id: str) -> AssetInfo | None:
        """What stands beside the bytes: it is written last, so that it vouches for them."""
        if not ID.fullmatch(id):
            return None
        try:
            info = AssetInfo(**json.loads(self._path(id, ".json").read_bytes()))
            if self._path(id).stat().st_size != info.bytes:
                return None  # the power failed before the disk had it all
            return replace(info, kind=KINDS[info.format])  # an older version took glTF for a mesh
        except (OSError, ValueError, TypeError, KeyError):
            return None

    def _builtin_bytes(self, id: str) -> bytes:
        found = self._builtin().get(id) if self._builtin and ID.fullmatch(id) else None
        if found is None:
            raise NotFound(f"there is no asset {id[:100]!r} here; upload it first")
        return found

    def _path(self, id: str, suffix: str = "") -> Path:
        return self._folder / (id.removeprefix("sha256:") + suffix)

    def _write(self, path: Path, data: Source, lasting: bool = True) -> None:
        """Whole or not at all; where it is to last also when the power fails."""
        fd, beside = tempfile.mkstemp(prefix=".", suffix=".tmp", dir=self._folder)
        try:
            with open(fd, "wb") as file:
                write(data, file)
                file.flush()
                if lasting:
                    os.fsync(fd)
            os.replace(beside, path)
        except BaseException:
            os.unlink(beside)
            raise
        if not lasting:
            return
        folder = os.open(self._folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def _limits(config: HasLimits | None) -> AssetLimits:
    if config is None:
        return AssetLimits()
    return AssetLimits(
        max_triangles=config.max_triangles,
        max_texels=config.max_texels,
        max_file=config.max_asset,
        seconds=config.parse_seconds,
        memory=config.parse_memory,
    )


def _format(data: bytes) -> str:
    """Of one of our own assets: its bytes tell."""
    return sniff(data) or "obj"


def _describe(id: str, format: str, size: int, parsed: Parsed) -> AssetInfo:
    warnings = [{"pointer": "", "detail": text} for text in parsed.warnings] or None
    if isinstance(parsed, ImageData):
        height, width, channels = parsed.pixels.shape
        size_ = {"width": width, "height": height, "channels": channels}
        return AssetInfo(id, KINDS[format], format, size, **size_, warnings=warnings)
    counts = {"vertices": len(parsed.vertices), "triangles": len(parsed.faces)}
    return AssetInfo(id, KINDS[format], format, size, **counts, bounds=_bounds(parsed), warnings=warnings)


def _bounds(mesh: MeshData) -> list[list[float]]:
    """Corners of the box around its triangles; a vertex of none does not count."""
    used = np.zeros(len(mesh.vertices), bool)
    used[mesh.faces] = True
    corners = mesh.vertices[used]
    return [corners.min(axis=0).tolist(), corners.max(axis=0).tolist()]
