"""The state that the routes share: configuration, assets, renderers, sessions."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import partial
from importlib import metadata
from typing import Any, get_args

from starlette.requests import HTTPConnection

from service import displays
from service.config import Config
from service.document import Scene
from service.document.quality import priced
from service.exports import FORMATS
from service.formats.formats import COMPRESSIONS, KINDS, missing
from service.formats.images import animation
from service.pack import Packed
from service.problems import Unavailable
from service.renderers.ask import BsdfQuestions
from service.renderers.protocol import Member, Renderers
from service.server.batches.batch import Batch, Members
from service.server.batches.queue import BatchQueue
from service.server.callbacks.queue import Callbacks
from service.server.http.downloads import Downloads
from service.server.http.request_log import Traffic
from service.server.readiness import SOFTWARE, Loading, Readiness
from service.server.renders.queue import RenderQueue
from service.server.renders.render import Render
from service.server.renders.store.record import Order, Outcome, StoredRender
from service.server.requests.bodies import Bodies
from service.server.requests.request_parser import unfolded
from service.server.requests.request_reader import RequestReader
from service.server.storage.callback_rows import Kind as CallbackKind
from service.server.storage.stores import Storage
from service.server.streams.sessions import Sessions
from service.system.executors import packing
from service.system.memory import MemoryBudget
from service.system.shares import Shares
from service.views import TONE_MAPS, FileFormat

MESSAGE_BYTES = 1 << 20  # of one message on a stream: larger geometry is uploaded as an asset
MOST_WAITS = 64  # long-polls and event streams of one caller: each takes some 40 KB, and all wake at a render's end
STARTING_S = 15.0  # how long a caller waits for a renderer that is being started
GPU_S = 60.0  # how long the start waits for one, where SUNBOX_REQUIRE_GPU is set
FAREWELL_S = 4.0  # how long the end waits for slow clients to read the last messages

log = logging.getLogger(__name__)


@dataclass
class AppState:
    config: Config
    storage: Storage
    reader: RequestReader
    renderers: Renderers
    render_queue: RenderQueue
    traffic: Traffic = field(default_factory=Traffic)
    loading: Loading = field(default_factory=Loading)
    address: str = ""  # of the server; "" where there is none, as under a test's client
    sessions: Sessions = field(init=False)
    downloads: Downloads = field(init=False)
    memory: MemoryBudget = field(init=False)
    bodies: Bodies = field(init=False)
    uploads: Shares = field(init=False)  # bytes of files that are being received and parsed, by caller
    readiness: Readiness = field(init=False)
    bsdf: BsdfQuestions = field(init=False)
    batches: BatchQueue = field(init=False)
    callbacks: Callbacks = field(init=False)
    waits: Shares = field(init=False)

    def __post_init__(self) -> None:
        self.memory = self.reader.memory
        loader = self.storage.assets.loader
        self.memory.cache("assets", lambda: loader.bytes, loader.shrink)
        self.memory.cache("scenes", self._resting_bytes, lambda size: None)
        self.memory.cache("assets", loader.sandbox.children.working_bytes, lambda size: None)
        self.memory.cache("pictures", lambda: 0, self.render_queue.loaded_pictures.shrink)  # renders count themselves
        self.memory.cache("scenes", lambda: self.render_queue.packed.bytes, self.render_queue.packed.shrink)
        self.bodies = Bodies(self.config, self.memory)
        most = max(self.config.max_bodies, 4 * self.config.max_body)
        self.uploads = Shares(most, "uploads (SUNBOX_MAX_BODIES)")
        self.bsdf = BsdfQuestions(self.renderers)
        self.batches = BatchQueue(self.render_queue, self._members, self._ended, self.config.max_running + 1)
        self.callbacks = Callbacks(self.config, self._ended_work)
        self.waits = Shares(self.config.max_connections, "long-polls and event streams", MOST_WAITS)
        self.downloads = Downloads(self.config.data_dir, self.memory)
        self.readiness = Readiness(self.renderers, self.reader, self.config.require_gpu, self.downloads)
        self.sessions = Sessions(self.renderers, self.reader, self.config.max_clients, self.config.max_key_clients)

    async def info(self) -> dict[str, Any]:
        """The answer of GET /v1/info. Waits for a renderer that is being started; null where there is none. One that
        has no place yet, as no node has joined its cluster, may never start, and is not waited for."""
        try:
            renderer: dict[str, Any] | None = await self.renderers.ready(
                0.0 if self.renderers.waiting else STARTING_S
            )
        except Unavailable:
            renderer = None
        return {
            "version": metadata.version("sunbox-server"),
            "renderer": renderer,
            "renderers": [_as_json(each) for each in self.renderers.members],
            "sandbox": asdict(await asyncio.to_thread(self.storage.assets.rights)),
            "memory": {"limit": self.memory.limit, "used": self.memory.used()},
            "limits": self.config.limits | {"max_message": MESSAGE_BYTES},
            "quality": priced(),
            "formats": file_formats(),
            "tone_maps": [*TONE_MAPS, *displays.names()],
        }

    async def resume_renders(self) -> None:
        """Continue the renders that an earlier server left. Without a data folder renders end with the server."""
        store = self.render_queue.store
        if store is None:
            return
        if not await asyncio.to_thread(store.usable):
            log.warning("renders will not outlive this server: the data folder cannot be written to")
            self.render_queue.store = None
            return
        stored = await asyncio.to_thread(store.load)
        members, batches = await asyncio.to_thread(store.members), await asyncio.to_thread(store.batches.all)
        await store.open()
        ended = await asyncio.to_thread(store.ended_members)
        self.render_queue.resume(stored, self._resumed, self.batches.resume(batches), members, ended)
        self.batches.go_on()
        await self.callbacks.start()

    def job(self, order: Order, document: bytes, packed: Packed, setup_s: float) -> Render:
        """A new render. Raises TooLarge for one that never fits into the memory."""
        outcome = Outcome(setup_s=setup_s, warnings=list(packed.warnings))
        return self._job(order, document, packed, outcome)

    def _job(self, order: Order, document: bytes | None, packed: Packed | None, outcome: Outcome) -> Render:
        load = partial(self._pack, order.owner)
        return Render(self.renderers, order, load, document, packed, outcome, self.memory, self.render_queue.packed)

    def _members(self, batch: Batch, body: bytes) -> Members:
        return Members(batch, body, self.reader, self._member)

    def _member(self, order: Order, document: bytes | None, packed: Packed | None) -> Render:
        """A new render of a batch. Raises TooLarge for one that never fits into the memory."""
        outcome = Outcome(warnings=list(packed.warnings) if packed is not None else [])
        return self._job(order, document, packed, outcome)

    def _ended_work(self, kind: CallbackKind, id: str, owner: str) -> Render | Batch:
        """The render or batch that a callback is about. Raises NotFound, Gone."""
        return self.batches.get(id, owner) if kind == "batch" else self.render_queue.get(id, owner)

    def _resumed(self, stored: StoredRender) -> Render:
        return self._ended(stored.order, stored.outcome)

    def _ended(self, order: Order, outcome: Outcome) -> Render:
        """A render that an earlier server had, or that cannot begin."""
        return Render(self.renderers, order, partial(self._pack, order.owner), outcome=outcome, budget=self.memory)

    async def _pack(self, owner: str, document: bytes, count: Callable[[int], None]) -> Packed:
        """The packed scene of an owner's folded document, which was valid when it was stored. Raises what reading it
        raises.

        `count` is called with the bytes of memory that parsing takes, before it begins, and packing likewise."""
        body = await packing(lambda: bytearray(unfolded(document), "ascii"))
        count(await packing(partial(self.bodies.memory_for, body)))
        scene: Scene = await self.bodies.parsed("scene", body)
        return await packing(partial(self.reader.pack, scene, owner=owner, hold=count))

    def _resting_bytes(self) -> int:
        """Bytes of this machine's memory that renderers on processors keep for a moment."""
        if self.config.ray is not None:  # theirs are other machines
            return 0
        return sum(member.statistics.load.resting_bytes for member in self.renderers.members)

    async def gpu_missing(self) -> str | None:
        """The reason why SUNBOX_REQUIRE_GPU forbids to start, or None. Waits for the renderer."""
        if not self.config.require_gpu or self.config.ray is not None:  # Ray has been asked for nodes with GPUs
            return None
        self.renderers.start()
        try:
            renderer = await self.renderers.ready(GPU_S)
        except Unavailable as error:
            return f"SUNBOX_REQUIRE_GPU is set, and there is no renderer: {error.detail}"
        return SOFTWARE.format(renderer=renderer["renderer"]) if renderer.get("software") else None

    async def sandbox_missing(self) -> str | None:
        """The reason why SUNBOX_REQUIRE_SANDBOX forbids to start, or None. Waits for a first process that parses."""
        if not self.config.require_sandbox:
            return None
        missing = (await asyncio.to_thread(self.storage.assets.rights)).missing
        if not missing:
            return None
        return f"SUNBOX_REQUIRE_SANDBOX is set, and the processes that parse are not confined: {', '.join(missing)}"

    async def farewell(self) -> None:
        """Tell all clients that the server ends, and answer open requests; renders go on at the next start."""
        await self.loading.tasks.close()
        self.renderers.drain()
        self.sessions.close("The server is shutting down.")
        until = time.monotonic() + FAREWELL_S
        await self.batches.close()
        await self.render_queue.close()
        await self.callbacks.close()
        while self.sessions.attended and time.monotonic() < until:
            await asyncio.sleep(0.01)


def _as_json(member: Member) -> dict[str, str | None]:
    return {**asdict(member.place), "vendor": member.vendor, "driver": member.driver, "state": member.state}


def app_state(connection: HTTPConnection) -> AppState:
    found: AppState = connection.app.state.sunbox
    return found


def caller_of(connection: HTTPConnection) -> str:
    """The caller, to whose limits a request counts: the owner of its key, or without keys the address's network.

    A client is one program or page at its connection; callers may have several.
    """
    found: str = connection.scope.get("caller", "")
    return found


def owner_of(connection: HTTPConnection) -> str:
    """The owner of what the request makes, by its key; "" where no keys are needed: it is everybody's."""
    found: str = connection.scope.get("owner", "")
    return found


def bodiless(connection: HTTPConnection) -> bool:
    """True if the request is for the head of the answer only."""
    return bool(connection.scope.get("bodiless", False))


READ_FORMATS = {
    "meshes": "mesh",
    "scenes": "scene",
    "images": "image",
    "luts": "lut",
    "measured": "measured",
}  # names of lists, by the kind of asset


def file_formats() -> dict[str, Any]:
    """File formats that this server reads and writes; those whose package is not here are `missing` alone."""
    read = {format: kind for format, kind in KINDS.items() if format not in missing()}
    return {
        "pictures": list(get_args(FileFormat)),
        "animations": list(animation.FORMATS),
        **{name: [format for format, each in read.items() if each == kind] for name, kind in READ_FORMATS.items()},
        "materials": [name for name in ("zip", "mtlx") if name not in missing()],
        "exports": [name for name, each in FORMATS.items() if each.has_scenes and each.is_provided],
        "compressions": list(COMPRESSIONS),
        "missing": missing(),
    }
