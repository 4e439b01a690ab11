"""A scene that is edited while frames of it arrive."""

from __future__ import annotations

import asyncio
import json
from dataclasses import dataclass, replace
from functools import reduce
from types import TracebackType
from typing import Any

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake

from sunbox import files, frames
from sunbox.errors import Failed, Refused, Unreachable, from_problem
from sunbox.merge import merged
from sunbox.transport import FIRST_CONTACT_S, Transport

GONE, LOST = 4404, 4500  # close codes of the server
REFUSED = {
    1009: "a message was too large",
    4401: "the key",
    4403: "the origin",
    4409: "the session is used elsewhere",
}


VERSIONS = 16  # scenes that the server took and that it may go back to


@dataclass(frozen=True)
class _Version:
    generation: int
    scene: files.Scene
    settings: dict[str, Any]


class AsyncStream:
    """A context manager and iterator of frames. Each frame is acknowledged when the next is asked for, so that a slow
    program gets fewer frames, never older ones. A connection that breaks is taken up again, the samples are kept.

    The iteration ends when the picture is done; after an `update` it can be iterated again. An update that the server
    refuses raises Refused in the iteration once, with the pointer of the field; iterated again, the stream goes on
    with frames of the last valid scene.
    """

    def __init__(
        self, transport: Transport, scene: Any, format: str, settings: dict[str, Any], generation: int = 0
    ) -> None:
        """`generation`: that of the scene that it begins with."""
        self._transport, self._given, self._view = transport, scene, {"format": format}
        # What the server took, the newest last; it goes back where a renderer fails at one.
        self._versions = [_Version(generation, {}, dict(settings))]
        self._socket: ClientConnection | None = None
        self._session: str | None = None
        self._unseen: list[dict[str, Any]] = []  # updates that the server may not have taken yet, in order
        self._count = generation  # of the last update
        self._unacknowledged: int | None = None
        self._again_after = transport.again()
        self._mending = asyncio.Lock()  # an update may be sent while a frame is waited for: one of them reconnects
        self._last = (-1, -1)  # generation and samples of the last frame as it is to look now
        self._overtaken: frames.Frame | None = None  # the newest that an update had overtaken, which may be refused
        self._done: dict[str, Any] | None = None  # the last word that a picture is done

    @property
    def generation(self) -> int:
        """The number of the last update, but for those that were refused."""
        return int(self._unseen[-1]["generation"]) if self._unseen else self._version.generation

    @property
    def _version(self) -> _Version:
        return self._versions[-1]

    @property
    def done(self) -> dict[str, Any] | None:
        """Why the picture is done, with its samples and noise; None before."""
        return self._done if self._done is not None and self._done["generation"] == self.generation else None

    @property
    def scene(self) -> files.Scene:
        """The document with all updates but those that were refused."""
        taken = self._version.scene
        return files.plain(reduce(lambda scene, update: merged(scene, update["scene"]), self._unseen, taken))

    async def __aenter__(self) -> AsyncStream:
        scene = await self._transport.uploaded(self._given)
        self._versions = [replace(self._version, scene=scene)]
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
            if (frame := self._overtaken) is not None and frame.generation == self.generation:
                self._overtaken, self._last = None, (frame.generation, frame.samples)
                return frame
            message = await self._receive()
            if isinstance(message, bytes):
                frame = frames.parse(message)
                self._taken(frame.generation)
                if frame.generation == self.generation:
                    self._unacknowledged, self._last = frame.seq, (frame.generation, frame.samples)
                    return frame
                self._overtaken = frame
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
        self._count += 1
        message = {"type": "update", "generation": self._count, "scene": change, "settings": settings}
        self._unseen.append(message)
        await self._send(message)

    async def view(self, **view: Any) -> None:
        """How frames look: format, quality, exposure, tone_map, color_space, lut, aov, max_fps, bits, prior. The
        picture goes on; where it is done, another frame comes."""
        self._view |= view
        self._last, self._overtaken = (-1, -1), None
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
        if hello["session"] != self._session:
            self._session = hello["session"]
            start = {"type": "start", **vars(self._version), "view": self._view}
            await self._socket.send(files.text(start))
        for message in self._unseen:  # the server may have taken it
            await self._socket.send(files.text(message))

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
                self._again_after = self._transport.again()
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
        if not await self._again_after.after(None if self._session else FIRST_CONTACT_S):
            raise Unreachable(f"No stream to {self._transport.url}: {said or error or type(error).__name__}.", code)

    def _is_over(self) -> bool:
        """The last frame may come before or after the word that the picture is done."""
        generation, samples = self._last
        return self.done is not None and generation == self.generation and samples >= self.done["samples"]

    def _heard(self, message: dict[str, Any]) -> None:
        if message["type"] == "error":
            problem = from_problem(message["problem"], int(message["problem"].get("status", 500)))
            if problem.pointer == "/generation":  # an update that was sent again, and had arrived before
                return
            refused = message["generation"]
            self._unseen = [each for each in self._unseen if each["generation"] != refused]
            if self._version.generation == refused:
                self._go_back(refused - 1)
            raise problem
        if message["type"] == "done":
            self._taken(message["generation"])
            self._done = message

    def _taken(self, generation: int) -> None:
        """The server has the updates up to this one, or went back to it."""
        self._go_back(generation)
        while self._unseen and self._unseen[0]["generation"] <= generation:
            update, before = self._unseen.pop(0), self._version
            scene, settings = merged(before.scene, update["scene"]), merged(before.settings, update["settings"])
            self._versions = [*self._versions, _Version(update["generation"], scene, settings)][-VERSIONS:]

    def _go_back(self, generation: int) -> None:
        """Forget the versions after this one."""
        while len(self._versions) > 1 and self._version.generation > generation:
            self._versions.pop()
