"""Requests to a server: its address, its key, when to ask again, and uploads."""

from __future__ import annotations

import asyncio
import email.utils
import hashlib
import json
import os
import random
import time
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit

import httpx2

from sunbox import files
from sunbox.errors import NotFound, SunboxError, Unreachable, from_problem

ADDRESS = "http://127.0.0.1:8000"
AGAIN = {429, 503}  # the server is full, or starting: it says when to come again
SHORTEST_PAUSE_S, FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.1, 0.25, 5.0
TIMEOUT_S = 60.0
PATIENCE_S = 60.0  # a server takes up to 15 s to end, and some to start, to find its renders and to compile
FIRST_CONTACT_S = 5.0  # where nothing has ever answered at an address, which is more likely a mistake than a restart


class Transport:
    """A server by the address that all its paths begin with. `url` and `key` come from SUNBOX_URL and SUNBOX_API_KEY
    where they are None; `timeout` is in seconds without a byte; `patience` is for how many seconds a server is asked
    again that is full, ends or starts; `asset_root`: folders beside a document's own from which it may name files.
    Raises ValueError for what is no address."""

    def __init__(
        self,
        url: str | None,
        key: str | None,
        timeout: float = TIMEOUT_S,
        patience: float = PATIENCE_S,
        asset_root: files.Folders = (),
    ) -> None:
        self.url = (url or os.environ.get("SUNBOX_URL") or ADDRESS).rstrip("/")
        self.key = key if key is not None else (os.environ.get("SUNBOX_API_KEY") or "").split(",")[0].strip() or None
        self.timeout, self.patience = timeout, patience
        self._roots = [asset_root] if isinstance(asset_root, str | os.PathLike) else list(asset_root)
        if urlsplit(self.url).scheme not in ("http", "https") or not urlsplit(self.url).netloc:
            raise ValueError(f"url={self.url!r} is not an address such as {ADDRESS}")
        headers = {"authorization": f"Bearer {self.key}"} if self.key else {}
        self._http = httpx2.AsyncClient(headers=headers, timeout=timeout)
        self._has_answered = False

    async def close(self) -> None:
        await self._http.aclose()

    async def json(self, method: str, path: str, body: Any = None, headers: Mapping[str, str] | None = None) -> Any:
        """The answer's document; None where it has none. Raises SunboxError."""
        data = None if body is None else files.text(body).encode()
        answer = await self.request(method, path, data, {"content-type": "application/json", **(headers or {})})
        return answer.json() if answer.content else None

    async def request(
        self,
        method: str,
        path: str,
        data: bytes | None = None,
        headers: Mapping[str, str] | None = None,
        patient: bool = False,
    ) -> httpx2.Response:
        """A request that may be sent twice: every one that this package makes. `patient`: its answer may take as long
        as it takes. Raises SunboxError."""
        timeout = httpx2.Timeout(self.timeout, read=None) if patient else httpx2.Timeout(self.timeout)
        again = self.again()
        while True:
            try:
                answer = await self._http.request(
                    method, self.url + path, content=data, headers=headers, timeout=timeout
                )
            except httpx2.TransportError as error:
                if not await again.after(None if self._has_answered else FIRST_CONTACT_S):
                    raise self._unreachable(error) from None
                continue
            self._has_answered = True
            if answer.status_code in AGAIN and await again.after(retry_after=answer.headers.get("retry-after")):
                continue
            if answer.is_error:
                raise from_problem(_document(answer.content), answer.status_code)
            return answer

    def again(self) -> Again:
        return Again(self.patience)

    async def events(self, path: str, last: str) -> AsyncIterator[tuple[str, Any]]:
        """The name and the document of each event up to the one named `last`. An answer that ends before it, because
        the connection broke or the server is restarted, is asked for again; patience begins anew with each event."""
        again = self.again()
        while True:
            pause = None
            error: SunboxError = Unreachable(f"{self.url} ended the events before the last one.")
            try:
                async with self._stream("GET", path) as answer:
                    name = ""
                    async for line in answer.aiter_lines():
                        field, _, value = line.partition(": ")
                        if field == "event":
                            name = value
                        elif field == "data":
                            again = self.again()
                            yield name, json.loads(value)
                            if name == last:
                                return
            except httpx2.TransportError as broken:
                error = self._unreachable(broken)
            except _Busy as busy:
                error, pause = busy.error, busy.retry_after
            if not await again.after(retry_after=pause):
                raise error

    async def upload(self, data: bytes, name: str, entry: str | None = None) -> str:
        """The id of a file's content, which is sent only where the server does not have it; `name` says how to read
        it. With `entry` that of this model of a zip. Raises SunboxError."""
        if entry is not None:
            return await self._sent(data, f"{quote(name)}&entry={quote(entry, safe='')}")
        id = f"sha256:{await asyncio.to_thread(lambda: hashlib.sha256(data).hexdigest())}"
        if not await self._has(id):  # asked each time: a server gives up what was not used for long
            id = await self._sent(data, quote(name))
        return id

    async def _sent(self, data: bytes, query: str) -> str:
        kind = {"content-type": "application/octet-stream"}
        return str((await self.request("POST", f"/v1/assets?filename={query}", data, kind)).json()["id"])

    async def upload_file(self, path: Path, entry: str | None = None) -> str:
        """As `upload`. Raises OSError, SunboxError."""
        return await self.upload(await asyncio.to_thread(path.read_bytes), path.name, entry)

    async def uploaded(self, scene: Any, pointer: str = "/scene") -> files.Scene:
        """A scene's document for the server: the files that it names by path are there. `pointer`: where it stands in
        the request. No other way leads from a document to this machine's files. Raises OSError, SunboxError."""
        document, folder = files.read_scene(scene, pointer)
        named = sorted(files.references(document).items())
        paths = {name: files.allowed(name, folder, self._roots, pointer + place) for name, place in named}
        return files.with_ids(document, {name: await self.upload_file(path) for name, path in paths.items()})

    async def _has(self, id: str) -> bool:
        try:
            await self.request("HEAD", f"/v1/assets/{id}")
        except NotFound:
            return False
        return True

    @asynccontextmanager
    async def _stream(self, method: str, path: str) -> AsyncIterator[httpx2.Response]:
        async with self._http.stream(method, self.url + path) as answer:
            if answer.is_error:
                error = from_problem(_document(await answer.aread()), answer.status_code)
                if answer.status_code in AGAIN:
                    raise _Busy(error, answer.headers.get("retry-after"))
                raise error
            yield answer

    def _unreachable(self, error: Exception) -> Unreachable:
        return Unreachable(f"No answer came from {self.url}: {error or type(error).__name__}.")


class Again:
    """When a request is sent again, and for how long."""

    def __init__(self, patience_s: float) -> None:
        self._patience_s, self._attempt = patience_s, 0
        self._began: float | None = None  # by the loop's clock, with the first failure

    async def after(self, most_s: float | None = None, retry_after: str | None = None) -> bool:
        """Return True when it is time for another attempt; False where patience is at its end, which comes after
        `most_s` seconds at the latest. `retry_after`: what the server said."""
        now = asyncio.get_running_loop().time()
        self._began = now if self._began is None else self._began
        left = min(self._patience_s, self._patience_s if most_s is None else most_s) - (now - self._began)
        if left <= 0:
            return False
        pause = max(_pause(self._attempt, retry_after), SHORTEST_PAUSE_S)
        await asyncio.sleep(min(pause, left))  # the last attempt is made at the end
        self._attempt += 1
        return True


class _Busy(Exception):
    def __init__(self, error: SunboxError, retry_after: str | None) -> None:
        super().__init__()
        self.error, self.retry_after = error, retry_after


def _document(content: bytes) -> Any:
    try:
        return json.loads(content)
    except ValueError:  # a proxy's page
        return None


def _pause(attempt: int, retry_after: str | None = None) -> float:
    """Seconds until the next attempt: as the server says, else twice as long each time, not all clients at once."""
    if retry_after is not None and retry_after.isdecimal():
        return float(retry_after)
    if retry_after is not None and (date := email.utils.parsedate_tz(retry_after)) is not None:
        return max(email.utils.mktime_tz(date) - time.time(), 0.0)
    return min(FIRST_PAUSE_S * 2.0**attempt, LONGEST_PAUSE_S) * random.uniform(0.5, 1.0)
