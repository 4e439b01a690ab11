"""The process that parses uploaded files: `python -m service.formats.sandbox.child FD ...`, a socket to the parent.

It answers requests one by one: a format and a file come in, arrays in sealed memory go out. It ends when the parent
does; it is killed when a file takes too much time, and its allocations fail when a file takes too much memory. Before
the first file it gives up all rights that it does not need, and sends the parent their list.
"""

import errno
import json
import mmap
import os
from typing import Any

import numpy as np

from service.formats.errors import MissingExtra, ParseError
from service.formats.read.foreign import assimp
from service.formats.read.measured import transfer
from service.formats.sandbox.wire import Pieces, publish, receive, send
from service.formats.types import (
    AssetLimits,
    ImageData,
    LutData,
    MeasuredData,
    MeshData,
    Pose,
    RenderedPicture,
    SceneFile,
    TakenFile,
)
from service.system.confined import begin, bounded, cap
from service.system.garbage import collector_paused
from service.system.shared_memory import trim

LARGE = 1 << 20  # bytes of a file after which freed memory is returned to the system
EARLY = ("PIL.Image", "PIL.PngImagePlugin", "PIL.JpegImagePlugin", "PIL.WebPImagePlugin", "OpenImageIO", "DracoPy")


def main(writes_memory: bool = False) -> None:
    link = begin(EARLY, writes_memory)
    is_capped = False
    while True:
        try:
            request, source = receive(link)
        except (EOFError, OSError):
            return
        if not is_capped:
            cap(**request["caps"])
            is_capped = True
        large = os.fstat(source).st_size > LARGE
        with collector_paused():
            reply, result = _answer(request, source)
        os.close(source)
        if large:
            trim()
        try:
            send(link, reply, result)
        except OSError:
            return
        if result >= 0:
            os.close(result)


def _answer(request: dict[str, Any], source: int) -> tuple[dict[str, Any], int]:
    limits = AssetLimits(**request["limits"])
    try:
        with bounded(request["memory"], limits.seconds):
            parsed = _parse(
                request["format"],
                source,
                limits,
                request["whole"],
                Pose(**request["pose"]),
                request["layer"],
                request["entry"],
            )
            arrays, facts = _arrays(parsed)
            del parsed
            fd, table = publish(arrays)
            return {"arrays": table, "is_spent": assimp.is_loaded(), **facts}, fd
    except ParseError as error:
        reply = {"error": error.detail[:2000], "pointer": error.pointer[:1000], "choices": error.choices}
        return reply | {"is_missing": isinstance(error, MissingExtra)}, -1
    except Exception as error:
        if isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM:
            return {"error": f"reading it takes more than the {request['memory'] >> 20} MiB allowed"}, -1
        # Libraries raise anything at all on nonsense; none of it may end the child.
        plain = isinstance(error, OSError | ValueError) and str(error)
        said = str(error) if plain else f"{type(error).__name__}: {error}"
        return {"error": f"it can't be read as {request['format'].upper()} ({said[:300]})"}, -1


Parsed = MeshData | ImageData | LutData | MeasuredData | SceneFile | RenderedPicture | TakenFile


def _parse(
    format: str, source: int, limits: AssetLimits, whole: bool, pose: Pose, layer: str, entry: str | None
) -> Parsed:
    """With `whole` a scene file is read with its materials, lights and camera, else only its triangles; and a picture
    as a render that was written with every layer. With `entry` a model of a zip becomes a file of its own."""
    from service.formats.formats import FOREIGN
    from service.formats.read.cube import parse_cube
    from service.formats.read.foreign.importer import read_foreign_scene
    from service.formats.read.gltf.importer import read_scene
    from service.formats.read.image import SIGNATURES, parse_image
    from service.formats.read.measured.adaptive import parse_adaptive
    from service.formats.read.measured.merl import parse_merl
    from service.formats.read.rendered import parse_rendered
    from service.formats.read.zips.importer import read_zip, taken
    from service.formats.sandbox.readers import parse_mesh, parse_mtlx, read_usd_scene

    size = os.fstat(source).st_size
    if not size:
        raise ParseError("the file is empty")
    if format in SIGNATURES:
        data = os.pread(source, size, 0)
        return parse_rendered(data, limits) if whole else parse_image(format, data, limits, layer)
    if format == "cube":
        return parse_cube(os.pread(source, size, 0))
    # The file is in memory already: it is mapped, not copied.
    mapped = memoryview(mmap.mmap(source, size, access=mmap.ACCESS_READ))
    if format == "binary":
        return parse_merl(mapped)
    if format == "bsdf":
        return parse_adaptive(mapped, limits)
    if entry is not None:
        return TakenFile(*taken(mapped, limits, entry))
    if not whole:
        return parse_mesh(format, mapped, limits)
    if format == "mtlx":
        return parse_mtlx(mapped, limits)
    if format == "usd":
        return read_usd_scene(mapped, limits, pose)
    if format in FOREIGN:
        return read_foreign_scene(format, mapped, limits, pose)
    return read_zip(mapped, limits, pose) if format == "zip" else read_scene(mapped, limits, pose)


def _arrays(parsed: Parsed) -> tuple[dict[str, Pieces], dict[str, Any]]:
    if isinstance(parsed, SceneFile):
        parts = [(len(p.data), p.pointer, p.vertices, p.triangles, p.bounds) for p in parsed.parts]
        animations = [vars(one) for one in parsed.animations]
        text = json.dumps(vars(parsed) | {"parts": parts, "animations": animations}).encode()
        files = [np.frombuffer(part.data, np.uint8) for part in parsed.parts]
        return {"scene": [np.frombuffer(text, np.uint8)], **({"files": files} if files else {})}, {}
    if isinstance(parsed, TakenFile):
        return {"taken": [np.frombuffer(parsed.data, np.uint8)]}, {"name": parsed.name}
    if isinstance(parsed, RenderedPicture):
        facts = {name: value for name, value in vars(parsed).items() if name != "layers"}
        return {"layers": [parsed.layers]}, facts
    if isinstance(parsed, LutData):
        return {"lut": [parsed.values]}, {"low": parsed.low, "high": parsed.high}
    if isinstance(parsed, MeasuredData):
        tables, facts = transfer.sent(parsed)
        return {name: [table] for name, table in tables.items()}, facts
    if isinstance(parsed, ImageData):
        return {"pixels": [parsed.pixels]}, {"warnings": list(parsed.warnings), "layers": list(parsed.layers)}
    arrays: dict[str, Pieces] = {
        name: [array] for name, array in vars(parsed).items() if isinstance(array, np.ndarray)
    }
    return arrays, {"warnings": list(parsed.warnings), "oddities": vars(parsed.oddities)}


if __name__ == "__main__":
    main()
