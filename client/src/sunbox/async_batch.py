"""Renders of one scene that differ along axes, and their pictures together."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlencode

from sunbox.async_job import AsyncJob, AsyncPicture, Status, unknown_ending
from sunbox.errors import Failed, SunboxError
from sunbox.progress import Line
from sunbox.transport import Transport

ENDED = ("done", "cancelled", "failed")
SHORTEST_WAIT_S, LONGEST_WAIT_S = 0.1, 2.0  # between two looks at a batch of which something is to come
ANIMATIONS = {".apng": "apng", ".png": "apng", ".webp": "webp", ".gif": "gif", ".avif": "avif", ".mp4": "mp4"}
SHEETS = {".png": "png", ".jpg": "jpeg", ".jpeg": "jpeg", ".webp": "webp"}


class AsyncBatch:
    """A batch by its `id`. It outlives this program and the server's restarts."""

    def __init__(self, transport: Transport, id: str) -> None:
        self._transport, self.id = transport, id
        self._path = f"/v1/batches/{quote(id, safe='')}"

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.id!r})"

    async def status(self, wait: float = 0) -> Status:
        """`state`, `counts` by state, `renders` with the id and state of each, `eta_s`. With `wait` it comes at the
        batch's end, or after that many seconds. Raises NotFound."""
        query = f"?wait={wait:g}" if wait else ""
        return dict(await self._transport.json("GET", self._path + query))

    async def wait(self, progress: bool | None = None) -> Status:
        """The status at the end. `progress`: None shows a line in a terminal and in a notebook. Cancelled while it
        waits, it cancels the batch."""
        status: Status = {}
        async for each in self._statuses(progress):
            status = each
        return status

    async def pictures(self, progress: bool | None = None) -> list[AsyncPicture]:
        """All pictures at the end, in their order. Raises Failed where one of the renders failed."""
        status = await self.wait(progress)
        return [await self._picture(each) for each in status["renders"]]

    async def as_completed(self) -> AsyncIterator[tuple[int, AsyncPicture]]:
        """Place and picture of each render as it is done, as soon as it is. Raises Failed where one failed."""
        seen = set[int]()
        async for status in self._statuses(False):
            for place, each in enumerate(status["renders"]):
                if place not in seen and each["state"] in ("done", "failed"):
                    seen.add(place)
                    yield place, await self._picture(each)

    async def sheet(self, format: str = "png", width: int | None = None, **view: Any) -> bytes:
        """A contact sheet of what there is: png, jpeg or webp; each picture at most `width` pixels wide. `view`:
        exposure, tone_map."""
        return await self._file("sheet", format=format, width=width, **view)

    async def animation(self, format: str = "apng", fps: float = 24, width: int | None = None, **view: Any) -> bytes:
        """The pictures that there are, one after the other: apng, webp, gif, avif, or mp4 where the server has
        ffmpeg."""
        return await self._file("animation", format=format, fps=fps, width=width, **view)

    async def zip(self, format: str = "png", **view: Any) -> bytes:
        """A zip of all pictures that there are; `view` as of a picture's `save`."""
        return await self._file("images.zip", format=format, **view)

    async def save_sheet(self, path: str | Path, width: int | None = None, **view: Any) -> None:
        """The contact sheet in the format of the path's ending. Raises OSError, SunboxError."""
        data = await self.sheet(_format(path, SHEETS), width, **view)
        await asyncio.to_thread(Path(path).write_bytes, data)

    async def save_animation(self, path: str | Path, fps: float = 24, width: int | None = None, **view: Any) -> None:
        """The animation in the format of the path's ending; .png is an APNG. Raises OSError, SunboxError."""
        data = await self.animation(_format(path, ANIMATIONS), fps, width, **view)
        await asyncio.to_thread(Path(path).write_bytes, data)

    async def cancel(self) -> None:
        """Ends it; the pictures so far stay. One that has ended is left as it is."""
        with contextlib.suppress(SunboxError):
            if (await self.status())["state"] not in ENDED:
                await self._transport.request("DELETE", self._path)

    async def delete(self) -> None:
        """Ends it where it goes on, and deletes it with its pictures."""
        await self.cancel()
        await self.status(60)
        await self._transport.request("DELETE", self._path)

    async def _statuses(self, progress: bool | None) -> AsyncIterator[Status]:
        """The status now and then, the last one being that of the end."""
        line, pause = Line(progress), SHORTEST_WAIT_S
        try:
            while True:
                status = await self.status(pause)
                line.show_batch(status)
                yield status
                if status["state"] in ENDED:
                    return
                pause = min(1.5 * pause, LONGEST_WAIT_S)
        except asyncio.CancelledError:
            await asyncio.shield(self.cancel())
            raise
        finally:
            line.close()

    async def _picture(self, render: dict[str, Any]) -> AsyncPicture:
        if render["state"] == "failed":
            problem = (await AsyncJob(self._transport, render["id"]).status())["problem"]
            raise Failed(str(problem["detail"]), problem.get("status"))
        return await AsyncJob(self._transport, render["id"]).picture()

    async def _file(self, name: str, **query: Any) -> bytes:
        asked = urlencode({key: value for key, value in query.items() if value is not None})
        return (await self._transport.request("GET", f"{self._path}/{name}?{asked}")).content


def _format(path: str | Path, formats: dict[str, str]) -> str:
    found = formats.get(Path(path).suffix.lower())
    if found is None:
        raise unknown_ending(path, formats)
    return found
