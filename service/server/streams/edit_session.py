"""A stream's scene as it is edited: its documents, their meaning, and the part that the renderer already has."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

from service.config import MIB
from service.document import Scene, merge_patch
from service.document.document import Parsed
from service.document.quality import ResolvedSettings
from service.document.text import weigh
from service.ipc.messages import Lut, Update
from service.pack import PackCache, parameter_edit, scene_edit
from service.problems import Conflict, FieldError, InvalidDocument, ServiceError, TooLarge
from service.renderers.replay_log import WorkingStates
from service.server.renders.scene import COPIES, picture_bytes
from service.server.requests.request_reader import RequestReader, stop_rule
from service.server.streams import protocol
from service.server.streams.scene_diff import SceneDiff, scene_diff

EACH = 8  # one scene may take an eighth of the memory of all


@dataclass(frozen=True)
class Version:
    """One generation: the documents as the client wrote them, and as they are understood."""

    generation: int
    scene_document: Any
    settings_document: Any
    scene: Scene
    settings: ResolvedSettings


@dataclass(frozen=True)
class Accepted:
    """A version, and the arrays that it was last packed as."""

    version: Version
    arrays: Any


class EditSession:
    """The documents of one stream. Its methods parse and pack: not on the event loop, and one call at a time."""

    def __init__(self, reader: RequestReader, task: int, owner: str = "") -> None:
        self.version: Version | None = None  # the last valid one
        self._reader = reader
        self._task = task
        self._owner = owner  # whose assets it may use
        self._cache = PackCache(budget=reader.caches)
        self._picture_bytes = 0
        self._bytes = 0  # that the scene's document takes at most
        self._given: Version | None = None  # the last one that the renderer has
        self._states = WorkingStates[Accepted]()
        self._difference: tuple[Version, Version, SceneDiff] | None = None  # of the last two that were compared
        self.packs = False  # `pack_pending` will pack more than a camera and materials
        self.works = -(2**63)  # the newest generation that the renderer was seen to have taken
        self._arrays: Any = None  # a gpu.SceneArrays: what it was made from, but for edits since

    def take(self, message: protocol.Start | protocol.Update) -> Update | None:
        """The update that the renderer needs at once; None where that can wait for `pack_pending`, after newer ones.

        Raises InvalidDocument or Conflict, and nothing has changed then.
        """
        if self.version is not None and message.generation <= self.version.generation:
            last = self.version.generation
            raise InvalidDocument([FieldError("/generation", f"must rise: {message.generation} comes after {last}")])
        version = self._started(message) if isinstance(message, protocol.Start) else self._updated(message)
        given, update = self._given, None
        # Whether such a scene can be packed is known when it was; then the update is as good as made.
        if given is None or self._diff(given, version).may_be_refused:
            update = self._give(version)
        self.version = version
        self.packs = update is None and given is not None and self._diff(given, version).whole
        return update

    def _diff(self, old: Version, new: Version) -> SceneDiff:
        """The difference between two versions; the last one is stored, as it is asked for more than once."""
        if self._difference is None or self._difference[0] is not old or self._difference[1] is not new:
            self._difference = old, new, scene_diff(old.scene, new.scene)
        return self._difference[2]

    def lut(self, id: str) -> Lut:
        """A table of displayed colours. Raises InvalidDocument."""
        return self._reader.lut(id, owner=self._owner)

    def pack_pending(self) -> Update | None:
        """The update that brings the renderer up to the documents; None when it is there."""
        version = self.version
        if version is None or version is self._given:
            return None
        try:
            return self._give(version)
        except ServiceError:
            self.version = self._given
            raise

    def failed(self, generation: int, fallback: int | None) -> Update | None:
        """The renderer failed at `generation` and goes on with `fallback`: the update that it needs then, if any."""
        version, given = self.version, self._given
        good = None if fallback is None else self._states.at(fallback)
        self._given = None
        if good is not None:
            self._given, self._arrays = good.version, good.arrays
        if version is None or version.generation <= generation:
            self.version = self._given
        elif given is not None and given.generation > generation:  # it was sent as a change of the one that failed
            self._given = None
            return self._give(version)
        return None

    def close(self) -> None:
        self._reader.memory.release(self)

    @contextmanager
    def _counted(self, document: Any, most: int) -> Iterator[None]:
        """Counts the scene's document, which takes `most` bytes or less; as before where it is refused after all.

        Raises TooLarge, TooManyRequests, Unavailable.
        """
        before, memory, limit = self._bytes, self._reader.memory, self._reader.stream_memory
        each = limit.most // EACH
        size = weigh(document) if most > each else most
        if size > each:
            allowed = f"the {each / MIB:g} MiB of memory allowed (SUNBOX_MAX_STREAM_MEMORY)"
            raise TooLarge(f"This scene takes more than {allowed}: big geometry goes through assets.")
        memory.hold(limit, self, size)
        self._bytes = size
        try:
            yield
        except BaseException:
            memory.hold(limit, self, before)
            self._bytes = before
            raise

    def _started(self, message: protocol.Start) -> Version:
        with self._counted(message.scene, weigh(message.scene)):
            scene, settings = self._reader.both(message.scene, message.settings)
        return Version(message.generation, message.scene, message.settings, scene, settings)

    def _updated(self, message: protocol.Update) -> Version:
        old = self.version
        if old is None:
            raise Conflict("Nothing was started yet: send start before update.")
        new = replace(old, generation=message.generation)
        if "scene" in message.model_fields_set:
            document = merge_patch(old.scene_document, message.scene)
            with self._counted(document, self._bytes + weigh(message.scene)):
                scene = self._reader.scene(document, Parsed(old.scene_document, old.scene))
            new = replace(new, scene_document=document, scene=scene)
        if "settings" in message.model_fields_set:
            document = merge_patch(old.settings_document, message.settings)
            new = replace(new, settings_document=document, settings=self._reader.settings(document))
        return new

    def _give(self, version: Version) -> Update:
        with self._room(version):
            update = self._update(version)
        self._given = version
        self._states.works(self.works)
        self._states.push(version.generation, Accepted(version, self._arrays))
        return update

    @contextmanager
    def _room(self, version: Version) -> Iterator[None]:
        """Counts the version's picture; as before where it is refused after all. Raises TooLarge, Unavailable."""
        memory, before, after = self._reader.memory, self._picture_bytes, picture_bytes(version.settings)
        memory.hold("pictures", self, max(before, after))
        try:
            yield
            self._picture_bytes = after
        finally:
            memory.hold("pictures", self, self._picture_bytes)

    def _update(self, new: Version) -> Update:
        old, update = self._given, Update(self._task, new.generation, interactive=True)
        if old is None or old.settings.for_gpu() != new.settings.for_gpu():
            update = replace(update, settings=new.settings.for_gpu())
        if old is None or stop_rule(old.settings) != stop_rule(new.settings):
            update = replace(update, stop=stop_rule(new.settings))
        if old is None or old.settings.denoise != new.settings.denoise:
            update = replace(update, denoise=new.settings.denoise)
        touched = None if old is None else self._diff(old, new)
        if old is None or touched is None or touched.whole:
            packed = self._reader.pack(new.scene, self._cache, owner=self._owner)
            self._reader.memory.release(packed)
            self._reader.memory.hold("scenes", self, COPIES * packed.bytes)
            edit = None if old is None else scene_edit(self._arrays, packed.arrays)
            self._arrays = packed.arrays
            if old is None or edit is None:
                return replace(update, scene=packed.arrays)
            return replace(update, base=old.generation, edit=edit)
        if touched.may_be_refused:  # for what is not drawn: its answer is all that is wanted
            self._reader.memory.release(self._reader.pack(new.scene, self._cache, owner=self._owner))
        names = ("camera", "materials", "environment", "numbers")
        parts = {name: getattr(touched, name) for name in names}
        edit = parameter_edit(self._arrays, new.scene, **parts) if any(parts.values()) else None
        return replace(update, base=old.generation, edit=edit)
