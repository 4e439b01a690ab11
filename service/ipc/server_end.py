"""The server's end of a channel, on its event loop. The renderer's process needs no event loop, and loads none."""

from __future__ import annotations

import asyncio
import socket
from collections import deque
from collections.abc import Callable
from typing import Any

from service.ipc.channel import Closed, Encoded, discard, encode, receive, transmit


class Channel:
    """The server's end: sends and receives on the event loop and never waits."""

    def __init__(self, end: socket.socket, receive: Callable[[Any], None], lost: Callable[[], None]) -> None:
        end.setblocking(False)
        self._end = end
        self._receive = receive
        self._lost = lost
        self._waiting: deque[Encoded] = deque()
        self.sent = 0  # messages that the other end can take
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(end, self._readable)

    def send(self, message: object) -> None:
        self.send_encoded(encode(message))

    def send_encoded(self, message: Encoded) -> None:
        """Sends what `encode` gave; its descriptor is the link's from now on."""
        if self._end.fileno() < 0:
            return discard(message)
        self._waiting.append(message)
        if len(self._waiting) == 1:
            self._writable()

    @property
    def backlog(self) -> int:
        """How many messages wait to be sent."""
        return len(self._waiting)

    def pause_reading(self) -> None:
        """Leave messages where they are: the other end waits, once the socket is full."""
        if self._end.fileno() >= 0:
            self._loop.remove_reader(self._end)

    def resume_reading(self) -> None:
        if self._end.fileno() >= 0:
            self._loop.add_reader(self._end, self._readable)

    def close(self) -> None:
        if self._end.fileno() < 0:
            return
        self._loop.remove_reader(self._end)
        self._loop.remove_writer(self._end)
        self._end.close()
        while self._waiting:
            discard(self._waiting.popleft())

    def _readable(self) -> None:
        while self._end.fileno() >= 0:
            try:
                message = receive(self._end)
            except BlockingIOError:
                return
            except Closed:
                self._lose()
                return
            self._receive(message)

    def _writable(self) -> None:
        while self._waiting:
            try:
                transmit(self._end, *self._waiting[0])
            except BlockingIOError:
                self._loop.add_writer(self._end, self._writable)
                return
            except ConnectionError:
                return  # the reader learns of the end after the last messages
            self.sent += 1
            discard(self._waiting.popleft())
        self._loop.remove_writer(self._end)

    def _lose(self) -> None:
        self.close()
        self._lost()
