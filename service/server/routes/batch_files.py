"""The pictures of a batch in one file: zipped, on a contact sheet, or one after the other."""

from __future__ import annotations

import asyncio
import io
import re
import tempfile
import time
import zipfile
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import BinaryIO, Literal, get_args

import numpy as np
from PIL import Image
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from service.formats import images
from service.formats.images import animation, over_black
from service.formats.images.animation import MIME, AnimationFormat, Animator, most_memory
from service.formats.images.contact_sheet import ContactSheet
from service.ipc.messages import View
from service.problems import Conflict, Gone, NotProvided, TooLarge
from service.server.batches.batch import Batch
from service.server.http.downloads import FileAnswer, Written
from service.server.renders.render import Render
from service.server.renders.store.store import MAKING
from service.server.requests.batch_request import variations_of
from service.server.routes import waiting
from service.server.routes.errors import GONE
from service.server.routes.renders import ImageQuery, picture_file
from service.server.state import app_state, caller_of
from service.system.disk_usage import Usage
from service.system.executors import filming, writing

SheetFormat = Literal["png", "jpeg", "webp"]
SHEET_FORMATS: tuple[SheetFormat, ...] = get_args(SheetFormat)
FRAMES = 64  # times SUNBOX_MAX_PIXELS: pixels of an animation
SHEET_PIXEL_BYTES = 6  # of a sheet while it is drawn and written: the drawing, and a copy of it
LONGEST_NAME = 80  # characters in the name of a zipped file


def zipped(request: Request, batch: Batch, query: ImageQuery, steps: Sequence[int]) -> Response:
    """A zip that is made while it is sent: no more than one picture is in memory. One that was deleted meanwhile is
    left out."""
    disposition = f'attachment; filename="{batch.id[:8]}.zip"'
    headers = {"cache-control": "no-store", "content-disposition": disposition}
    return StreamingResponse(_zip(request, batch, query, steps), media_type="application/zip", headers=headers)


async def _zip(request: Request, batch: Batch, query: ImageQuery, steps: Sequence[int]) -> AsyncIterator[bytes]:
    sent = _Unseekable()
    with zipfile.ZipFile(sent, "w", zipfile.ZIP_STORED) as archive:  # pictures are compressed already
        for step in steps:
            try:
                job = await _render(request, batch, step)
                written = await picture_file(request, job, query)
            except (Conflict, Gone):
                continue
            assert written is not None  # as nobody says that the client has gone
            data = await writing(partial(_whole, written))
            entry = zipfile.ZipInfo(f"{_file_name(batch, step, job)}.{query.format}", _date(job))
            await writing(partial(archive.writestr, entry, data))
            yield sent.taken()
    yield sent.taken()


async def _render(request: Request, batch: Batch, step: int) -> Render:
    return await app_state(request).batches.render_of(batch, step)


def _whole(written: Written) -> bytes:
    written.file.seek(0)
    return written.file.read()


def _file_name(batch: Batch, step: int, job: Render) -> str:
    digits = max(4, len(str(batch.order.renders - 1)))
    name = re.sub(r"[^A-Za-z0-9.]+", "-", job.order.label or "").strip("-.")[:LONGEST_NAME]
    return f"{step:0{digits}}-{name}" if name else f"{step:0{digits}}"


def _date(job: Render) -> tuple[int, int, int, int, int, int]:
    """When it ended, by the clock of zip files, which begins in 1980."""
    year, month, day, hour, minute, second, *_ = time.gmtime(job.outcome.ended_at or 0)
    return (year, month, day, hour, minute, second) if year >= 1980 else (1980, 1, 1, 0, 0, 0)


class _Unseekable(io.RawIOBase):
    """Collects what is written until it is taken."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []

    def writable(self) -> bool:
        return True

    def write(self, data: bytes) -> int:  # type: ignore[override]
        self._pieces.append(bytes(data))
        return len(data)

    def taken(self) -> bytes:
        pieces, self._pieces = self._pieces, []
        return b"".join(pieces)


async def sheet(
    request: Request, batch: Batch, format: SheetFormat, width: int | None, view: View, steps: list[int]
) -> Response:
    """A contact sheet; its cells say of the renders that have no picture how far they are."""
    cell = await _scaled(request, batch, steps, width)
    layout = await writing(partial(_layout, batch, cell))
    across, down = await writing(lambda: layout.size)  # which measures every name
    pixels, most = across * down, app_state(request).config.max_pixels
    if pixels > most:
        detail = (
            f"The sheet would have {pixels} pixels: no more than {most} are allowed (SUNBOX_MAX_PIXELS); ask for "
        )
        raise TooLarge(detail + "a smaller width.")

    state = app_state(request)

    async def make(folder: Path) -> Written:
        pictures = _Spooled(folder / "pictures", cell)
        await pictures.fill(request, batch, steps, view)
        places = {step: i for i, step in enumerate(steps)}

        def write(file: BinaryIO) -> None:
            def picture(k: int) -> Image.Image | None:
                return pictures.at(places[k]) if k in places else None

            drawn = layout.drawn(picture, batch.state_of)
            images.write(file, np.asarray(drawn), format)

        with state.memory.reserved("pictures", SHEET_PIXEL_BYTES * pixels):
            return await writing(partial(state.downloads.write, write, 3 * pixels))

    made = _Made(("sheet", format, width, view), steps, cell, images.FORMATS[format].mime, 3 * pixels)
    return await _answered(request, batch, made, make)


async def animated(
    request: Request,
    batch: Batch,
    format: AnimationFormat,
    fps: float,
    width: int | None,
    view: View,
    steps: list[int],
) -> Response:
    cell = await _scaled(request, batch, steps, width)
    pixels, most = cell[0] * cell[1] * batch.order.renders, FRAMES * app_state(request).config.max_pixels
    if pixels > most:
        detail = (
            f"The animation would have {pixels} pixels: no more than {FRAMES} times SUNBOX_MAX_PIXELS are allowed"
        )
        raise TooLarge(f"{detail}, which is {most}; ask for a smaller width.")
    if format == "mp4":
        try:
            animation.encoder()
        except animation.NoEncoder as error:
            raise NotProvided(str(error)) from None

    state = app_state(request)

    async def make(folder: Path) -> Written:
        pictures = _Spooled(folder / "pictures", cell)
        await pictures.fill(request, batch, steps, view)
        animator = Animator(pictures.path, cell, len(steps), format, fps)
        with state.memory.reserved("pictures", most_memory(cell, len(steps))):
            try:
                return await filming(partial(state.downloads.write, animator.write, most_bytes))
            finally:
                animator.stop()

    most_bytes = 3 * cell[0] * cell[1] * len(steps)
    made = _Made(("animation", format, fps, width, view), steps, cell, MIME[format], most_bytes)
    return await _answered(request, batch, made, make)


@dataclass(frozen=True)
class _Made:
    """A file of a batch's pictures, which `what` tells from others of the same batch."""

    what: tuple[object, ...]
    steps: list[int]
    cell: tuple[int, int]  # width and height of one picture
    mime: str
    most_bytes: int

    @property
    def disk(self) -> Usage:
        """What is on the disk while it is made: the pictures, and the file."""
        return Usage(3 * self.cell[0] * self.cell[1] * len(self.steps) + self.most_bytes, 2)


async def _answered(
    request: Request, batch: Batch, made: _Made, make: Callable[[Path], Awaitable[Written]]
) -> Response:
    """The answer, from a file that is made once for all who ask while no other render of the batch ends. Closing the
    connection ends the work."""
    making = asyncio.ensure_future(_written(request, batch, made, make))
    if not await waiting.until(request, making):
        return Response(status_code=GONE)
    written = making.result()
    return FileAnswer(written.file, made.mime, {"cache-control": "no-store"}, source=written)


async def _written(
    request: Request, batch: Batch, made: _Made, make: Callable[[Path], Awaitable[Written]]
) -> Written:
    state, caller = app_state(request), caller_of(request)
    key = (batch.id, *made.what, tuple(made.steps))
    async with batch.making:
        if (written := state.downloads.find(key)) is None:
            with state.downloads.making(caller, made.most_bytes):
                async with state.storage.quota.making(made.disk):
                    with tempfile.TemporaryDirectory(prefix=MAKING, dir=_folder(state.config.data_dir)) as folder:
                        written = await make(Path(folder))
            state.downloads.keep(caller, key, written, lasting=True)
    return written


def _folder(data: Path) -> Path | None:
    """Where pictures are put one after the other: beside the data, where that can be written to."""
    try:
        with tempfile.TemporaryFile(dir=data):
            return data
    except OSError:
        return None


class _Spooled:
    """Pictures of one size on the disk, one after the other."""

    def __init__(self, path: Path, size: tuple[int, int]) -> None:
        self.path, self._size = path, size

    async def fill(self, request: Request, batch: Batch, steps: Sequence[int], view: View) -> None:
        for step in steps:
            job = await _render(request, batch, step)
            pixels, _ = await job.image(view)
            await writing(partial(self._append, pixels))

    def _append(self, pixels: np.ndarray) -> None:
        picture = Image.fromarray(over_black(pixels))
        if picture.size != self._size:
            picture = picture.resize(self._size, Image.Resampling.LANCZOS)
        with self.path.open("ab") as file:
            file.write(picture.tobytes())

    def at(self, index: int) -> Image.Image:
        size = 3 * self._size[0] * self._size[1]
        with self.path.open("rb") as file:
            file.seek(index * size)
            return Image.frombytes("RGB", self._size, file.read(size))


async def _scaled(request: Request, batch: Batch, steps: Sequence[int], width: int | None) -> tuple[int, int]:
    """Width and height of one picture: those of the first that is done, scaled down to a width."""
    settings = (await _render(request, batch, steps[0])).order.settings
    if width is None or width >= settings.width:
        return settings.width, settings.height
    return width, max(1, round(settings.height * width / settings.width))


def _layout(batch: Batch, cell: tuple[int, int]) -> ContactSheet:
    """One axis is a list, two are rows and columns; of more the last is the columns, the others are the rows."""
    axes = variations_of(batch.order.axes)
    *before, last = axes.axes
    heading = [axis.title for axis in axes.axes if axis.title]
    columns = [last.label(step) for step in range(len(last))]
    if not before:
        return ContactSheet(cell, columns, heading=heading)
    rows = [", ".join(axes.labels(row * len(last))[:-1]) for row in range(len(axes) // len(last))]
    return ContactSheet(cell, columns, rows, heading)
