"""Parsing in a bounded process beside the service: a file can cost no more than its limits, whatever is in it."""

import json
import logging
import os
import signal
import threading
from dataclasses import asdict, replace
from types import TracebackType
from typing import Any

import numpy as np

from service.formats.errors import MissingExtra, ParseError
from service.formats.formats import FOREIGN, KINDS
from service.formats.read.measured import transfer
from service.formats.sandbox.wire import Array, adopt, memory, receive, send
from service.formats.types import (
    Animation,
    AssetLimits,
    ImageData,
    LutData,
    MeasuredData,
    MeshData,
    MeshOddities,
    Pose,
    RenderedPicture,
    SceneFile,
    ScenePart,
    TakenFile,
)
from service.system.child_processes import Child, Children, Closed, signal_name
from service.system.confined import Rights
from service.system.turns import FairRoom

log = logging.getLogger(__name__)

# Address space: what the libraries need at most beside the arrays; what a texel of the largest image needs (float
# RGBA, thrice); and a byte of a mesh file: 42 were seen for an OBJ of one-letter words, 9 for one of a million
# triangles with normals, so a big file gets less for each.
BASE_BYTES = 512 << 20
USD_BYTES = 1 << 30  # more for a USD file: 570 MB were seen for the library's code, 440 MB for its threads' heaps
BYTES_PER_TEXEL = 48
BYTES_PER_MESH_BYTE, BYTES_PER_BIG_MESH_BYTE, BIG_MESH_BYTES = 64, 12, 4 << 30
# That OBJ is read at 0.05 s a megabyte; for a slower machine under load.
SECONDS_PER_BYTE = 0.25 / (1 << 20)
FILES = 64  # for one child
USUAL_RATIO = 6  # of a zip's files to the zip: a text of numbers shrinks to a third, its faces to a fifth
# The memory of a big file returns to the machine: by default glibc reuses blocks of up to 32 MiB.
ENVIRONMENT = {
    "OPENIMAGEIO_THREADS": "1",
    "MALLOC_MMAP_THRESHOLD_": "1048576",
    "MALLOC_TRIM_THRESHOLD_": "4194304",
}
CRASHES = {
    signal.SIGXCPU: "reading it takes more processor time than the {seconds:g} s allowed",
    signal.SIGKILL: "reading it was stopped: the machine ran out of memory",
}

Parsed = MeshData | ImageData | LutData | MeasuredData | SceneFile | RenderedPicture | TakenFile

# The type of each array of a mesh, and the shape of its rows.
MESH_ARRAYS: dict[str, tuple[str, tuple[tuple[int, ...], ...]]] = {
    "vertices": ("<f8", ((3,),)),
    "faces": ("<i4", ((3,),)),
    "normals": ("<f4", ((3,),)),
    "uvs": ("<f4", ((2,),)),
    "uvs_1": ("<f4", ((2,),)),
    "colors": ("<f4", ((3,), (4,))),
    "tangents": ("<f4", ((4,),)),
    "groups": ("<i4", ((),)),
}


class Sandbox:
    """`parse` from any thread; at most `limits.children` files at once, and one less of one caller; the others wait.

    Children start on demand.
    """

    def __init__(self, limits: AssetLimits) -> None:
        self.limits = limits
        self._room = FairRoom(limits.children)
        self._asking = threading.Lock()
        self._rights: Rights | None = None
        self.children = Children("service.formats.sandbox.child", FILES, ENVIRONMENT)
        self._cad_children = Children("service.formats.sandbox.cad_child", FILES, ENVIRONMENT)

    def start(self) -> None:
        """Start a child for the first file, without waiting."""
        with self.children.one() as child:
            child.given = 0

    def rights(self) -> Rights:
        """The rights that a child gives up before it reads a file. Waits for the first child, and logs it once."""
        with self._asking:
            if self._rights is None:
                try:
                    self._rights = self.children.rights() or Rights()
                except Closed:
                    return Rights()
                _log_rights(self._rights)
            return self._rights

    def parse(
        self, format: str, source: bytes | int, layer: str = ""
    ) -> MeshData | ImageData | LutData | MeasuredData:
        """`format` is a key of KINDS; `source` the bytes or an open file. Of a scene all its triangles as one mesh;
        of an EXR the layer of a name.

        Raises ParseError.
        """
        parsed = self._bounded(format, source, False, layer=layer)
        assert isinstance(parsed, MeshData | ImageData | LutData | MeasuredData)
        return parsed

    def parse_scene(self, format: str, source: bytes | int, pose: Pose | None = None) -> SceneFile:
        """Raises ParseError."""
        parsed = self._bounded(format, source, True, pose)
        assert isinstance(parsed, SceneFile)
        return parsed

    def parse_rendered(self, source: bytes | int) -> RenderedPicture:
        """An EXR that was written with every layer of a render. Raises ParseError."""
        parsed = self._bounded("exr", source, True)
        assert isinstance(parsed, RenderedPicture)
        return parsed

    def take(self, format: str, source: bytes | int, entry: str) -> tuple[str, bytes | memoryview]:
        """A model of a zip as a file of its own, and the name of that. Raises ParseError."""
        parsed = self._bounded(format, source, True, entry=entry)
        assert isinstance(parsed, TakenFile)
        return parsed.name, parsed.data

    def _bounded(
        self,
        format: str,
        source: bytes | int,
        whole: bool,
        pose: Pose | None = None,
        layer: str = "",
        entry: str | None = None,
    ) -> Parsed:
        fd = memory(source, "sunbox-source") if isinstance(source, bytes) else source
        try:
            with self._room.taken():
                return self._parse(format, fd, whole, pose or Pose(), layer, entry)
        finally:
            if isinstance(source, bytes):
                os.close(fd)

    def _parse(self, format: str, fd: int, whole: bool, pose: Pose, layer: str, entry: str | None) -> Parsed:
        size = os.fstat(fd).st_size
        if size > self.limits.max_file:
            raise ParseError(f"{size} bytes; {self.limits.max_file} are allowed")
        if KINDS[format] == "image":
            worst = BYTES_PER_TEXEL * self.limits.max_texels + size
        else:
            if format == "zip":
                size = min(USUAL_RATIO * size, self.limits.max_file)
            worst = min(BYTES_PER_MESH_BYTE * size, BIG_MESH_BYTES + BYTES_PER_BIG_MESH_BYTE * size)
            worst += USD_BYTES if format in ("usd", "zip", *FOREIGN) else 0
        limits = replace(self.limits, seconds=self.limits.seconds + SECONDS_PER_BYTE * size)
        memory = min(BASE_BYTES + worst, self.limits.memory)
        caps = {"memory": self.limits.memory, "seconds": FILES * self._most_seconds, "written": self.limits.memory}
        request = {
            "format": format, "whole": whole, "pose": asdict(pose), "memory": memory, "limits": asdict(limits),
            "caps": caps, "layer": layer, "entry": entry,
        }  # fmt: skip
        try:
            with (self._cad_children if format == "step" else self.children).one() as child:
                reply, result = _ask(child, request, fd, limits)
                # An error may have been an attempt; and what Assimp has read is not freed.
                child.is_spent = "error" in reply or reply.get("is_spent") is True
        except Closed:
            raise ParseError("the service is shutting down") from None
        return _result(reply, result)

    @property
    def _most_seconds(self) -> float:
        """For the largest file."""
        return self.limits.seconds + SECONDS_PER_BYTE * self.limits.max_file

    def close(self) -> None:
        """Ends the children that wait; one that parses ends with its file."""
        self.children.close()
        self._cad_children.close()

    def __enter__(self) -> "Sandbox":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _log_rights(rights: Rights) -> None:
    given_up = [name for name in asdict(rights) if name not in rights.missing]
    if rights.missing:
        text = "the kernel leaves rights to the processes that parse uploads"
        log.warning(text, {"missing": ",".join(rights.missing), "given_up": ",".join(given_up) or "none"})
    else:
        log.info("uploads are parsed without rights", {"given_up": ",".join(given_up), "landlock": rights.landlock})


def _ask(child: Child, request: dict[str, Any], fd: int, limits: AssetLimits) -> tuple[dict[str, Any], int]:
    """The child's reply. Raises ParseError where it died or took too long; it must be killed then."""
    try:
        send(child.link, request, fd)
        if not child.answers(limits.seconds):
            raise ParseError(f"reading it takes longer than the {limits.seconds:g} s allowed")
        return receive(child.link)
    except (EOFError, OSError):
        raise ParseError(_death(child, limits)) from None


def _death(child: Child, limits: AssetLimits) -> str:
    code = child.exit_code()
    if code is None:
        return "reading it crashed the parser"
    log.warning("the parser died", {"exit_code": code})
    for number, text in CRASHES.items():
        if code == -number:
            return text.format(seconds=limits.seconds)
    return f"reading it crashed the parser ({signal_name(code)})"


def _result(reply: dict[str, Any], fd: int) -> Parsed:
    if "error" in reply:
        kind = MissingExtra if reply.get("is_missing") is True else ParseError
        raise kind(str(reply["error"]), str(reply.get("pointer", "")), tuple(map(str, reply.get("choices", ()))))
    try:
        arrays = adopt(fd, reply["arrays"])
    finally:
        os.close(fd)
    if "taken" in arrays:
        return TakenFile(str(reply["name"]), arrays["taken"].data)
    if "pixels" in arrays:
        return ImageData(arrays["pixels"], tuple(map(str, reply["warnings"])), tuple(map(str, reply["layers"])))
    if "lut" in arrays:
        return lut_of(arrays["lut"], reply["low"], reply["high"])
    if "density" in arrays:
        return transfer.received(arrays, reply)
    if "layers" in arrays:
        estimator, sampler, depth = reply["ways"]
        return RenderedPicture(
            arrays["layers"], int(reply["samples"]), int(reply["seed"]), bool(reply["denoised"]),
            (str(estimator), str(sampler), int(depth)),
        )  # fmt: skip
    if "scene" in arrays:
        return _scene(arrays["scene"], arrays.get("files", np.empty(0, np.uint8)))
    return mesh_of(arrays, tuple(map(str, reply["warnings"])), _oddities(reply["oddities"]))


def lut_of(values: Array, low: list[float], high: list[float]) -> LutData:
    """Raises ValueError where it has not the form that the renderer relies on."""
    sides = values.shape[:-1]
    if values.dtype.str != "<f4" or values.shape[-1] != 3 or len(sides) not in (1, 3) or min(sides) < 2:
        raise ValueError(f"a table with shape {values.shape} and dtype {values.dtype}")
    if len(set(sides)) != 1:
        raise ValueError(f"a table with shape {values.shape}")
    (x, y, z), (u, v, w) = map(float, low), map(float, high)
    return LutData(values, (x, y, z), (u, v, w))


def mesh_of(arrays: dict[str, Array], warnings: tuple[str, ...], oddities: MeshOddities) -> MeshData:
    """The mesh of these arrays. Raises ValueError where one has not the form that compiled code relies on: the child
    that made them read a stranger's file."""
    vertices, faces = arrays["vertices"], arrays["faces"]
    count = {"faces": len(faces), "groups": len(faces)}
    for name, array in arrays.items():
        dtype, widths = MESH_ARRAYS[name]
        if array.dtype.str != dtype or array.shape[1:] not in widths or len(array) != count.get(name, len(vertices)):
            raise ValueError(f"{name} of a mesh with shape {array.shape} and dtype {array.dtype}")
    if faces.size and not 0 <= faces.min() <= faces.max() < len(vertices):
        raise ValueError("a face names a vertex that is not there")
    get = arrays.get
    return MeshData(
        vertices, faces, get("normals"), get("uvs"), get("uvs_1"), get("colors"), warnings, get("tangents"),
        get("groups"), oddities,
    )  # fmt: skip


def _oddities(found: dict[str, Any]) -> MeshOddities:
    """The child is not trusted with types."""
    return MeshOddities(
        int(found["coinciding"]), int(found["differing"]), int(found["crowded"]), int(found["turned"]),
        bool(found["inwards"]), int(found.get("rim", 0)),
    )  # fmt: skip


def _scene(text: Array, files: Array) -> SceneFile:
    facts, view, parts, at = json.loads(text.tobytes()), files.data, [], 0
    for size, pointer, vertices, triangles, bounds in facts["parts"]:
        parts.append(ScenePart(view[at : at + size], str(pointer), vertices, triangles, bounds))
        at += size
    return SceneFile(
        facts["document"], parts, facts["warnings"], int(facts["triangles"]), bool(facts["lit"]), facts["exposure"],
        facts["aspect_ratio"], facts["bounds"], [str(name) for name in facts["variants"]],
        [Animation(str(one["name"]), float(one["duration"])) for one in facts["animations"]],
    )  # fmt: skip
