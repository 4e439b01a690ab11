"""A USD file as layers in memory, whose references lead nowhere but into the upload.

Each layer is anonymous: it has no place on the disk from which a path could start. What a layer refers to is looked
up in the package (a .usdz, or any zip), and every path to a layer there is replaced by that layer's own identifier
before anything is composed; a path that leads elsewhere is removed. So USD never resolves a path that a stranger
wrote.
"""

from __future__ import annotations

import os
import posixpath
import re
from dataclasses import dataclass, field
from functools import partial

from pxr import Sdf, Tf, Usd, UsdUtils, Work

from service.formats.errors import ParseError
from service.formats.formats import CRATE, PACKAGES, USD_LAYERS, USD_TEXT, missing, text
from service.formats.read.archive import Archive
from service.formats.read.materialx.document import is_standard, read_document
from service.formats.read.references import Found
from service.formats.read.scenes.warnings import Warnings
from service.formats.read.usd.materialx_layer import layer_of
from service.formats.read.usd_names import WORDS
from service.formats.types import AssetLimits

PACKAGE, MATERIALX = ".usdz", ".mtlx"
INSIDE, OUTSIDE = "inside:", "outside:"  # before the path of a file that is not a layer, in the package or not
SHADERS = (".mdl", ".osl", ".oso", ".glslfx", ".mtlx")  # code, of which the importer of materials speaks
DEEPEST = 256  # prims within prims: the library calls itself for each, and 20 000 overflow its stack
# Braces, and what may hold some that mean nothing: texts, asset paths, comments.
BRACES = re.compile(WORDS + rb"| [{}]", re.DOTALL | re.VERBOSE)
ALONE = "which is not part of this one; save the scene as a .usdz, or upload a zip of its folder"


@dataclass
class Package:
    """The layers of a file, and the images beside them. Raises ParseError where a layer cannot be read.

    `files` is the zip that holds its layers, and `path` that of its root there; a layer that came alone has neither.
    """

    data: bytes | memoryview
    notes: Warnings
    files: Archive | None = None
    path: str = ""
    _layers: dict[str, Sdf.Layer] = field(default_factory=dict)
    _unread: list[str] = field(default_factory=list)  # names of layers whose paths are still those of the file

    def __post_init__(self) -> None:
        self.root = self._layer(self.path)
        while self._unread:
            name = self._unread.pop()
            layer = self._layers[name]
            composed = frozenset(layer.GetCompositionAssetDependencies())  # references, payloads and sublayers
            UsdUtils.ModifyAssetPaths(layer, partial(self._replaced, name, composed))

    def stage(self) -> Usd.Stage:
        """The composed scene."""
        try:
            return Usd.Stage.Open(self.root, Usd.Stage.LoadAll)
        except Tf.ErrorException as error:
            raise ParseError(f"its layers cannot be composed ({_said(error)})") from None

    def file(self, path: str) -> bytes | None:
        """The bytes of a file that a layer names, by the path that its attribute has now; None for one outside."""
        if self.files is None or not path.startswith(INSIDE):
            return None
        return self.files.read(path.removeprefix(INSIDE))

    def _layer(self, name: str) -> Sdf.Layer:
        if name not in self._layers:
            if name.lower().endswith(MATERIALX):
                self._layers[name] = self._materialx(name)
            else:
                self._layers[name] = _read(self.data if self.files is None else self.files.read(name), name)
            self._unread.append(name)
        return self._layers[name]

    def _materialx(self, name: str) -> Sdf.Layer:
        """The materials of a MaterialX file; none, with a warning, of one that can't be read."""
        assert self.files is not None
        try:
            return layer_of(read_document(name, self.files.read, self._included), name, self.notes)
        except ParseError as error:
            self.notes.leave_out(name, f"{error.detail}; what is in it is left out")
            return Sdf.Layer.CreateAnonymous(".usda")

    def _included(self, source: str, name: str) -> str | None:
        """The path of a MaterialX file that another one includes."""
        found = self._located(source, name)
        if found is None and not is_standard(name):
            self.notes.add(source, f"it includes {name[:100]!r}, which is not in the upload; it is read without that")
        return found

    def _replaced(self, layer: str, composed: frozenset[str], path: str) -> str:
        """The path that a layer gets instead of its author's; `composed` are those that lead to other layers, by
        whatever suffix."""
        found = self._located(layer, path)
        lower = path.lower()
        if found is not None and (found.lower().endswith(USD_LAYERS) or (path in composed and self._is_layer(found))):
            identifier: str = self._layer(found).identifier
            return identifier
        if path in composed:
            unread = f"which needs {PACKAGES['mtlx'][0]}" if lower.endswith(MATERIALX) else "which is no USD layer"
            what = ALONE if found is None else unread
            self.notes.leave_out(
                layer or path, f"it refers to another file, {path[:100]!r}, {what}; that is left out"
            )
            return ""
        if found is not None and not lower.endswith(SHADERS):
            return INSIDE + found
        if lower.endswith((*USD_LAYERS, ".usdz", ".abc")) or "[" in path:
            self.notes.leave_out(
                layer or path, f"it refers to another file, {path[:100]!r}, {ALONE}; that is left out"
            )
            return ""
        if lower.endswith(MATERIALX):
            self.notes.add(layer or path, f"the MaterialX file {path[:100]!r} is not read; what is in it is left out")
            return ""
        return OUTSIDE + path[:200]

    def _is_layer(self, name: str) -> bool:
        assert self.files is not None
        if name.lower().endswith(MATERIALX):
            return "mtlx" not in missing()
        return self.files.read(name).startswith((USD_TEXT, CRATE))

    def _located(self, layer: str, path: str) -> str | None:
        """The name of a file of the package: relative to the layer, else to the package's root, else by its last
        part."""
        if self.files is None or not path or "\0" in path:
            return None
        finder = self.files.finder
        found = finder.find(layer, path)
        if found is not None and found.remark and (there := finder.path(posixpath.normpath(path))) is not None:
            found = Found(there)
        if found is None:
            return None
        if found.remark:
            self.notes.add(layer or path, found.remark)
        self.files.used.add(found.path)  # whether or not the variants that are selected show it
        return found.path


def root_layers(archive: Archive, names: list[str]) -> list[str]:
    """Those of the layers and packages of a zip that no other layer composes; of several those that no other of them
    names at all, as it does a clip. The first where that leaves none. Raises ParseError."""
    if len(names) == 1 or (names and names[0] == archive.names[0] and archive.is_package):
        return names[:1]
    composed, named = set[str](), dict[str, set[str]]()
    for name in names:
        if name.lower().endswith(PACKAGE):
            continue
        layer = _read(archive.head(name, archive.size(name)), name)
        dependencies = set(layer.GetCompositionAssetDependencies())
        for path in dependencies | set(_paths(layer)):
            found = archive.finder.find(name, path)
            if found is not None and found.path != name:
                named.setdefault(name, set()).add(found.path)
                composed |= {found.path} if path in dependencies else set()
    roots = [name for name in names if name not in composed] or names[:1]
    others = {path for root in roots for path in named.get(root, ())}
    return [name for name in roots if name not in others] or roots[:1]


def _paths(layer: Sdf.Layer) -> list[str]:
    """All paths of files in a layer, which is as it was afterwards."""
    found: list[str] = []

    def kept(path: str) -> str:
        found.append(path)
        return path

    UsdUtils.ModifyAssetPaths(layer, kept)
    return found


def opened(data: bytes | memoryview, limits: AssetLimits, notes: Warnings) -> Package:
    """A layer that came alone, or a package, whose first file is its root. Raises ParseError."""
    if bytes(data[:4]) != b"PK\x03\x04":
        return Package(data, notes)
    files = Archive(data, limits.max_file)
    root = next((name for name in files.names if name.lower().endswith(USD_LAYERS)), "")
    if not root:
        raise ParseError("the package holds no layer, a .usd, .usda or .usdc file")
    return Package(b"", notes, files, root)


def _read(data: bytes | memoryview, name: str) -> Sdf.Layer:
    """A layer without a place, from its bytes. The tag of an anonymous layer says its format, no more."""
    Work.SetConcurrencyLimit(1)  # the child has one core's worth of time, and its threads would want memory each
    binary = bytes(data[: len(CRATE)]) == CRATE
    layer = Sdf.Layer.CreateAnonymous(".usdc" if binary else ".usda")
    try:
        if binary:
            _fill(layer, data)
        else:
            words = text(bytes(data))
            if not words.startswith(USD_TEXT):
                raise ParseError("it is no USD layer: it begins neither with #usda nor with PXR-USDC", name)
            if _depth(words) > DEEPEST:
                raise ParseError(f"its prims are nested more than {DEEPEST} deep", name)
            layer.ImportFromString(words.decode("utf-8", "replace"))
    except Tf.ErrorException as error:
        raise ParseError(f"the layer cannot be read ({_said(error)})", name) from None
    return layer


def _depth(words: bytes) -> int:
    """How deep the braces of a text layer are nested."""
    depth = deepest = 0
    for found in BRACES.finditer(words):
        depth += {b"{": 1, b"}": -1}.get(found[0], 0)
        deepest = max(deepest, depth)
    return deepest


def _fill(layer: Sdf.Layer, data: bytes | memoryview) -> None:
    """Read a binary layer, which the library takes from a file only: from one in memory, through its descriptor."""
    file = os.memfd_create("sunbox-layer", os.MFD_CLOEXEC)
    try:
        view = memoryview(data)
        while view:
            view = view[os.write(file, view) :]
        if not layer.Import(f"/proc/self/fd/{file}"):
            raise ParseError("the binary layer cannot be read")
    finally:
        os.close(file)


def _said(error: Tf.ErrorException) -> str:
    """The library's words about a file, without the names of its own sources."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    said = next((line.rpartition(" : '")[2].rstrip("'") for line in lines if " : '" in line), "it is broken")
    return re.sub(r" matching pxr\S+", "", said)[:200]
