"""How one message travels through Ray: small ones together, large ones by the object store.

A scene is stored there once, by a digest of its content; Ray brings it to each node once, however many renderers are
sent it. It is freed when no task has it any more.
"""

from __future__ import annotations

import asyncio
import hashlib
import pickle
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from service.ipc.messages import SceneData, ToRenderer

LARGE = 100 * 1024  # bytes of arrays; Ray keeps smaller arguments out of its object store, too

User = tuple[object, int]  # of a scene: a lane, and the number of its task


def size(message: ToRenderer) -> int:
    """The bytes of a message's arrays."""
    buffers: list[pickle.PickleBuffer] = []
    pickle.dumps(message, protocol=5, buffer_callback=buffers.append)
    return sum(buffer.raw().nbytes for buffer in buffers)


def digest(scene: SceneData) -> bytes:
    """A digest of a scene's content; equal scenes have equal ones, whichever messages brought them."""
    buffers: list[pickle.PickleBuffer] = []
    found = hashlib.blake2b(pickle.dumps(scene, protocol=5, buffer_callback=buffers.append), digest_size=32)
    for buffer in buffers:
        found.update(buffer.raw())
    return found.digest()


@dataclass
class Scenes:
    """The scenes in the object store, as references that Ray counts."""

    _stored: dict[bytes, asyncio.Future[Any]] = field(default_factory=dict)
    _users: Counter[bytes] = field(default_factory=Counter)
    _of: dict[User, bytes] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self._stored)

    async def put(self, user: User, scene: SceneData) -> Any:
        """The reference to a scene, which `user` has from now on in place of an earlier one."""
        key = await asyncio.to_thread(digest, scene)
        self._users[key] += 1
        self.forget(user)
        self._of[user] = key
        if key not in self._stored:
            self._stored[key] = asyncio.ensure_future(stored(scene))
        return await asyncio.shield(self._stored[key])

    def forget(self, user: User) -> None:
        key = self._of.pop(user, None)
        if key is None:
            return
        self._users[key] -= 1
        if not self._users[key]:
            del self._users[key], self._stored[key]

    def forget_all(self, lane: object) -> None:
        for user in [user for user in self._of if user[0] is lane]:
            self.forget(user)


async def stored(value: object) -> Any:
    """The reference to an object that was copied to the object store, which is not for an event loop."""
    import ray

    return await asyncio.to_thread(ray.put, value)
