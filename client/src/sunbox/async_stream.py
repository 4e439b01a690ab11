"""A scene that is edited while frames of it arrive."""

from __future__ import annotations

import asyncio
import json
from functools import reduce
from types import TracebackType
from typing import Any

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake

from sunbox import files, frames
from sunbox.errors import Failed, Refused, Unreachable, from_problem
from sunbox.merge import merged
from sunbox.transport import Transport

GONE, LOST = 4404, 4500  # close codes of the server
REFUSED = {
    1009: "a message was too large",
    4401: "the key",
    4403: "the origin",
    4409: "the session is used elsewhere",
}
PAUSE_S = 0.5  # before the connection is taken up again, longer each time


class AsyncStream:
    """A context manager and iterator of frames. Each frame is acknowledged when the next is asked for, so that a slow
    program gets fewer frames, never older ones. A connection that breaks is taken up again, the samples are kept.

    The iteration ends when the picture is done; after an `update` it can be iterated again. An update that the server
    refuses raises Refused at the next frame; the stream stays at the last valid scene and may be gone on with.
    """

    def __init__(self, transport: Transport, scene: Any, format: str, settings: dict[str, Any]) -> None:
        self._transport, self._given, self._view = transport, scene, {"format": format}
        self._settings: dict[str, Any] = dict(settings)
        self._scene: files.Scene = {}
        self._socket: ClientConnection | None = None
        self._session: str | None = None
        self._unseen: list[dict[str, Any]] = []  # updates that the server may not have taken yet, in order
        self._unacknowledged: int | None = None
        self._attempt = 0
        self._mending = asyncio.Lock()  # an update may be sent while a frame is waited for: one of them reconnects
        self._samples = -1  # of the last frame as it is to look now
        self.generation = 0
        self.done: dict[str, Any] | None = None

    @property
    def scene(self) -> files.Scene:
        """The document with all updates but those that were refused."""
        return files.plain(reduce(lambda scene, update: merged(scene, update["scene"]), self._unseen, self._scene))

    async def __aenter__(self) -> AsyncStream:
        self._scene = await self._transport.uploaded(self._given)
        await self._connect()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._socket is not None:
            await self._socket.close()

    def __aiter__(self) -> AsyncStream:
        return self

    async def __anext__(self) -> frames.Frame:
        if self._unacknowledged is not None:
            await self._send({"type": "ack", "seq": self._unacknowledged})
            self._unacknowledged = None
        while not self._is_over():
            message = await self._receive()
            if isinstance(message, bytes):
                frame = frames.parse(message)
                self._taken(frame.generation)
                if frame.generation == self.generation:
                    self._unacknowledged, self._samples = frame.seq, frame.samples
                    return frame
                await self._send({"type": "ack", "seq": frame.seq})
            else:
                self._heard(json.loads(message))
        raise StopAsyncIteration

    async def update(self, patch: dict[str, Any] | None = None, **settings: Any) -> None:
        """Changes the scene by a merge patch, `{"materials": {"ball": {"roughness": 0.2}}}`, and settings by their
        names. As on the wire, `{"scene": ..., "settings": ...}` is understood, too. Null takes a member away."""
        patch = {} if patch is None else patch
        if patch.keys() and patch.keys() <= {"scene", "settings"}:
            settings = {**patch.get("settings", {}), **settings}
            patch = patch.get("scene", {})
        change = await self._transport.uploaded(patch)
        self.generation, self.done, self._samples = self.generation + 1, None, -1
        message = {"type": "update", "generation": self.generation, "scene": change, "settings": settings}
        self._unseen.append(message)
        await self._send(message)

    async def view(self, **view: Any) -> None:
        """How frames look: format, quality, exposure, tone_map, color_space, lut, aov, max_fps, bits, prior. The
        picture goes on; where it is done, another frame comes."""
        self._view |= view
        self._samples = -1
        await self._send({"type": "view", **view})

    async def pause(self) -> None:
        await self._send({"type": "pause"})

    async def resume(self) -> None:
        await self._send({"type": "resume"})

    async def _connect(self) -> None:
        """A new connection to the session; where the server knows it no more, a new session with the scene as it
        is."""
        address = f"ws{self._transport.url.removeprefix('http')}/v1/stream"
        headers = {"authorization": f"Bearer {self._transport.key}"} if self._transport.key else {}
        while True:
            query = f"?session={self._session}" if self._session else ""
            try:
                self._socket = await connect(
                    address + query,
                    additional_headers=headers,
                    subprotocols=["sunbox.v1"],  # type: ignore[list-item]  # a NewType of str
                    max_size=None,
                    open_timeout=self._transport.timeout,
                )
                hello = json.loads(await self._socket.recv())
                break
            except (OSError, ConnectionClosed, InvalidHandshake, TimeoutError) as error:
                await self._again(error)
        self._unacknowledged = None  # the server begins to count anew
        if hello["session"] == self._session:
            for message in self._unseen:  # the server may have taken it
                await self._socket.send(files.text(message))
            return
        self._session = hello["session"]
        self._taken(self.generation)
        start = {"type": "start", "generation": self.generation, "scene": self._scene, "settings": self._settings}
        await self._socket.send(files.text({**start, "view": self._view}))

    async def _send(self, message: dict[str, Any]) -> None:
        if self._socket is None:
            raise RuntimeError("a stream is used as a context manager: `with client.stream(scene) as stream:`")
        socket = self._socket
        try:
            await socket.send(files.text(message))
        except ConnectionClosed as error:
            await self._taken_up(error, socket)
            if message["type"] in ("view", "pause", "resume"):  # updates were sent again, and frames are counted anew
                await self._send(message)

    async def _receive(self) -> str | bytes:
        if self._socket is None:
            raise RuntimeError("a stream is used as a context manager: `with client.stream(scene) as stream:`")
        while True:
            socket = self._socket
            try:
                message = await socket.recv()
                self._attempt = 0
                return message
            except ConnectionClosed as error:
                await self._taken_up(error, socket)

    async def _taken_up(self, error: ConnectionClosed, broken: ClientConnection) -> None:
        async with self._mending:
            if self._socket is broken:
                await self._again(error)
                await self._connect()

    async def _again(self, error: Exception) -> None:
        """Returns when it is time to try again. Raises SunboxError where that would change nothing."""
        code = error.rcvd.code if isinstance(error, ConnectionClosed) and error.rcvd else None
        said = error.rcvd.reason if isinstance(error, ConnectionClosed) and error.rcvd else ""
        if code in REFUSED:
            raise Refused(f"The server closed the stream: {said or REFUSED[code]}.", code)
        if code == LOST:
            raise Failed(f"The server closed the stream: {said or 'its renderer is lost'}.", code)
        if code == GONE:
            self._session = None
            return
        if self._attempt >= self._transport.retries:
            raise Unreachable(f"No stream to {self._transport.url}: {said or error or type(error).__name__}.", code)
        await asyncio.sleep(PAUSE_S * 2.0**self._attempt)
        self._attempt += 1

    def _is_over(self) -> bool:
        """The last frame may come before or after the word that the picture is done."""
        return self.done is not None and self._samples >= self.done["samples"]

    def _heard(self, message: dict[str, Any]) -> None:
        if message["type"] == "error":
            problem = from_problem(message["problem"], int(message["problem"].get("status", 500)))
            if problem.pointer == "/generation":  # an update that was sent again, and had arrived before
                return
            self._unseen = [each for each in self._unseen if each["generation"] != message["generation"]]
            raise problem
        if message["type"] == "done" and message["generation"] == self.generation:
            self._taken(self.generation)
            self.done = message

    def _taken(self, generation: int) -> None:
        """The server has the updates up to this one."""
        while self._unseen and self._unseen[0]["generation"] <= generation:
            update = self._unseen.pop(0)
            self._scene, self._settings = (
                merged(self._scene, update["scene"]),
                merged(self._settings, update["settings"]),
            )
