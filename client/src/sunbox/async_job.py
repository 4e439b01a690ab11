"""A render on the server, and its picture."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable
from io import BytesIO
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlencode

import numpy as np
from numpy.typing import NDArray

from sunbox.errors import Failed, Refused, SunboxError
from sunbox.progress import Line
from sunbox.transport import Transport

Status = dict[str, Any]
Pixels = NDArray[np.float32]
FORMATS = {
    ".png": "png",
    ".jpg": "jpeg",
    ".jpeg": "jpeg",
    ".webp": "webp",
    ".avif": "avif",
    ".exr": "exr",
    ".hdr": "hdr",
    ".npy": "npy",
}


class AsyncJob:
    """A render by its `id`. It outlives this program and the server's restarts; whoever knows the id can ask for it
    again."""

    def __init__(self, transport: Transport, id: str) -> None:
        self._transport, self.id = transport, id
        self._path = f"/v1/renders/{quote(id, safe='')}"

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.id!r})"

    async def status(self) -> Status:
        """`state` is queued, running, done, cancelled or failed. Raises NotFound."""
        return dict(await self._transport.json("GET", self._path))

    async def events(self) -> AsyncIterator[Status]:
        """The status whenever it changes, at most ten times a second; the last is that of the end."""
        async for _, status in self._transport.events(f"{self._path}/events", last="done"):
            yield status

    async def result(self, progress: bool | None = None) -> AsyncPicture:
        """The picture at the end. `progress`: None shows a line in a terminal and in a notebook. Cancelled while it
        waits, it cancels the render. Raises Failed with the server's reason, Refused where the render was cancelled
        without a picture."""
        line = Line(progress)
        try:
            async for status in self.events():
                line.show(status)
        except asyncio.CancelledError:
            await asyncio.shield(self.cancel())
            raise
        finally:
            line.close()
        if "problem" in status:
            problem = status["problem"]
            raise Failed(str(problem["detail"]), problem.get("status"))
        if not status["samples"]:
            raise Refused(f"Render {self.id} was cancelled before its first sample.")
        return AsyncPicture(self._fetch, status)

    async def picture(self) -> AsyncPicture:
        """The picture so far. Raises Refused (409) before the first sample, when its pixels are asked for."""
        return AsyncPicture(self._fetch, await self.status())

    async def cancel(self) -> None:
        """Ends it; the picture so far stays. One that has ended is left as it is."""
        with contextlib.suppress(SunboxError):
            if (await self.status())["state"] in ("queued", "running"):
                await self._transport.request("DELETE", self._path)

    async def delete(self) -> None:
        """Ends it where it goes on, and deletes its picture."""
        await self.cancel()
        await self._transport.request("DELETE", self._path)

    async def _fetch(self, format: str, view: dict[str, Any]) -> bytes:
        query = urlencode({"format": format, **view})
        return (await self._transport.request("GET", f"{self._path}/image?{query}")).content


def unknown_ending(path: str | Path, formats: Iterable[str]) -> Refused:
    """A file of that name has no format."""
    detail = f"the name must end in one of {', '.join(formats)}"
    return Refused(f"{path}: {detail}", errors=[("/path", detail)])


Fetch = Callable[[str, dict[str, Any]], Awaitable[bytes]]


class AsyncPicture:
    """A picture that is fetched as it is asked for. `samples` a pixel; `noise` is the estimated RMSE of the
    luminance over its mean, None before 2 samples; `warnings` say what the renderer did not take as it was written;
    `settings` what each knob became."""

    def __init__(self, fetch: Fetch, status: Status) -> None:
        """`fetch` gives a file of a format, as it is to look."""
        self._fetch, self._status = fetch, status
        self._fetched: dict[tuple[str, tuple[tuple[str, Any], ...]], bytes] = {}

    @property
    def id(self) -> str | None:
        """The render on the server; None of a picture that this process rendered."""
        return self._status.get("id")

    @property
    def samples(self) -> int:
        return int(self._status["samples"])

    @property
    def noise(self) -> float | None:
        noise = self._status["noise"]
        return None if noise is None else float(noise)

    @property
    def warnings(self) -> list[str]:
        return list(self._status["warnings"])

    @property
    def settings(self) -> dict[str, Any]:
        return dict(self._status["settings"])

    @property
    def status(self) -> Status:
        return dict(self._status)

    async def numpy(self) -> Pixels:
        """(height, width, 4) linear float32, premultiplied by alpha; row 0 is the top."""
        return await self.aov("color")

    async def aov(self, name: str) -> Pixels:
        """(height, width, channels): `albedo`, `normal`, `variance` have 3, `depth` and others 1, `color` 4. Raises
        Refused for a name that the server does not have."""
        return np.asarray(np.load(BytesIO(await self.fetch("npy", aov=name)), allow_pickle=False))

    async def exr(self) -> bytes:
        """An OpenEXR file with the colour and every AOV as layers."""
        return await self.fetch("exr", aov="all")

    async def png(self, **view: Any) -> bytes:
        """As on a screen. `view`: bits, exposure, tone_map, color_space, lut, aov."""
        return await self.fetch("png", **view)

    async def save(self, path: str | Path, **view: Any) -> None:
        """A file in the format of its ending: .png, .jpg, .webp, .avif, .exr, .hdr or .npy. `view`: bits, exposure,
        tone_map, color_space, lut, aov. Raises OSError, SunboxError."""
        path = Path(path)
        format = FORMATS.get(path.suffix.lower())
        if format is None:
            raise unknown_ending(path, FORMATS)
        data = await self.fetch(format, **view)
        await asyncio.to_thread(path.write_bytes, data)

    async def fetch(self, format: str, **view: Any) -> bytes:
        """The bytes of a file in a format."""
        key = format, tuple(sorted(view.items()))
        if key not in self._fetched:
            self._fetched[key] = await self._fetch(format, view)
        return self._fetched[key]
