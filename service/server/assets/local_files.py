"""Assets of a scene on disk: paths relative to its file, for the command line only."""

import errno
import hashlib
import os
import stat
from pathlib import Path
from types import TracebackType

from service.formats.cache import Parsed, ParsedCache, as_image, as_lut, as_measured, as_mesh, layered, refused
from service.formats.errors import ParseError
from service.formats.source import format_of
from service.formats.types import AssetLimits, ImageData, LutData, MeasuredData, MeshData
from service.problems import AssetError, NotFound
from service.server.assets.store import AssetStore

MOST_LISTED = 10_000  # files of a folder; as many as a zip may hold


class FileAssets:
    """Files inside `folder` or one of `roots`, links followed first; a `sha256:` id leads to `fallback`.

    A path is taken from `folder`, and where nothing is there from each of the roots.
    """

    def __init__(self, folder: Path, roots: list[Path], fallback: AssetStore | None = None) -> None:
        self._bases = [Path(os.path.realpath(base)) for base in (folder, *roots)]
        self._fallback = fallback
        self._loader = fallback.loader if fallback else ParsedCache(AssetLimits())

    def mesh(self, ref: str) -> MeshData:
        """Raises AssetError."""
        if ref.startswith("sha256:"):
            return self._store(ref).mesh(ref)
        return as_mesh(self._load(ref), repr(ref))

    def image(self, ref: str, layer: str = "") -> ImageData:
        """Raises AssetError."""
        if ref.startswith("sha256:"):
            return self._store(ref).image(ref, layer)
        return as_image(self._load(ref, layer), repr(ref))

    def measured(self, ref: str) -> MeasuredData:
        """Raises AssetError."""
        if ref.startswith("sha256:"):
            return self._store(ref).measured(ref)
        return as_measured(self._load(ref), repr(ref))

    def lut(self, ref: str) -> LutData:
        """Raises AssetError."""
        if ref.startswith("sha256:"):
            return as_lut(self._store(ref).load(ref), ref)
        return as_lut(self._load(ref), repr(ref))

    def read(self, ref: str) -> bytes:
        """The bytes of a file. Raises AssetError."""
        if ref.startswith("sha256:"):
            try:
                return self._store(ref).read(ref)
            except NotFound as error:
                raise AssetError(error.detail) from None
        fd = _open(self._find(ref), ref)
        with open(fd, "rb") as file:
            return file.read()

    def holds(self, ref: str) -> bool:
        """True if such a file exists. Raises AssetError for a path that may not be read."""
        return _exists(self._find(ref))

    def listed(self) -> list[str]:
        """The paths of all files in these folders, without links; none of folders that hold too many to look at."""
        found: dict[str, None] = {}
        for base in self._bases:
            for folder, _, names in os.walk(base):
                if len(found) + len(names) > MOST_LISTED:
                    return []
                paths = (Path(folder, name) for name in names)
                found |= {path.relative_to(base).as_posix(): None for path in paths if not path.is_symlink()}
        return list(found)

    def add(self, ref: str) -> None:
        """Copy a file into the store. Raises AssetError, Unavailable."""
        data, parsed = self.read(ref), self._load(ref)
        # Under the id that the store will ask for: a file is parsed once.
        self._loader.load("sha256:" + hashlib.sha256(data).hexdigest(), lambda: parsed)
        self._store(ref).add(data, filename=ref)

    def close(self) -> None:
        """Ends the parser, unless it is the fallback's."""
        if self._fallback is None:
            self._loader.close()

    def __enter__(self) -> "FileAssets":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _store(self, ref: str) -> AssetStore:
        if self._fallback is None:
            raise AssetError(f"there is no asset {ref[:100]!r} here")
        return self._fallback

    def _load(self, ref: str, layer: str = "") -> Parsed:
        fd = _open(self._find(ref), ref)
        try:
            found = os.fstat(fd)
            key = f"{found.st_dev}:{found.st_ino}:{found.st_size}:{found.st_mtime_ns}"
            return self._loader.load(layered(key, layer), lambda: self._parse(fd, ref, found.st_size, layer))
        finally:
            os.close(fd)

    def _parse(self, fd: int, ref: str, size: int, layer: str) -> Parsed:
        limits = self._loader.sandbox.limits
        if size > limits.max_file:
            raise AssetError(f"{ref!r} has {size} bytes; {limits.max_file} are allowed")
        with open(fd, "rb", closefd=False) as file:
            format = format_of(file, filename=ref) if size else None
        if format is None:
            what = "is empty" if not size else "is not a mesh or an image in a supported format"
            raise AssetError(f"{ref!r} {what}")
        try:
            return self._loader.sandbox.parse(format, fd, layer)
        except ParseError as error:
            raise refused(repr(ref), error) from None

    def _find(self, ref: str) -> Path:
        """The path of the file without links. The file may be gone when it is opened."""
        if not ref or "\0" in ref:
            raise AssetError(f"{ref[:100]!r} is not a file name")
        if os.path.isabs(ref):
            raise AssetError(f"{ref[:100]!r} is an absolute path; write it relative to the scene's file")
        candidates = [Path(os.path.realpath(base / ref)) for base in self._bases]
        allowed = [path for path in candidates if any(path.is_relative_to(base) for base in self._bases)]
        if not allowed:
            raise AssetError(f"{ref[:100]!r} leaves the scene's folder; --asset-root DIR allows another one")
        return next((path for path in allowed if _exists(path)), allowed[0])


def _exists(path: Path) -> bool:
    try:
        return path.exists() and not path.is_dir()
    except OSError:  # a name too long
        return False


def _open(path: Path, ref: str) -> int:
    try:
        # The open fails at a link that was put there meanwhile, and does not wait for a pipe without a writer.
        fd = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError as error:
        what = "there is no such file" if error.errno == errno.ENOENT else os.strerror(error.errno or 0).lower()
        raise AssetError(f"{ref[:100]!r}: {what}") from None
    mode = os.fstat(fd).st_mode
    if not stat.S_ISREG(mode):
        os.close(fd)
        raise AssetError(f"{ref[:100]!r} is {'a folder' if stat.S_ISDIR(mode) else 'not an ordinary file'}")
    return fd
