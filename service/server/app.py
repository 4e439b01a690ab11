"""The application, which serves the routes and the editor's files, and the server that runs it."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import AsyncIterator, Iterator, Sequence
from contextlib import asynccontextmanager
from functools import partial
from importlib import metadata
from pathlib import Path

import uvicorn
from fastapi import Depends, FastAPI
from starlette.requests import HTTPConnection
from starlette.responses import FileResponse, Response

from service.config import Config
from service.document import presets
from service.problems import Unavailable
from service.renderers.pool.devices import renderer_specs
from service.renderers.pool.pool import RendererPool, RendererSpec
from service.renderers.ray.joining import CannotJoin
from service.renderers.ray.pool import cluster_pool
from service.server.http.compression import Compressed
from service.server.http.connection_limits import Watch
from service.server.http.connections import connection_class
from service.server.http.downloads import Pieces
from service.server.http.guard import Guard, open_for_health, turning_away
from service.server.http.request_log import Requests
from service.server.readiness import foresee, warm_up
from service.server.renders.queue import RenderQueue
from service.server.renders.retention import QueueLimits, Retention
from service.server.renders.store.store import RenderStore
from service.server.requests.request_reader import RequestReader
from service.server.routes import (
    assets,
    batches,
    bsdf,
    callbacks,
    compare,
    documents,
    export,
    info,
    materials,
    renders,
    stream,
)
from service.server.routes import presets as preset_routes
from service.server.routes.description import describe
from service.server.routes.editor_files import EditorFiles
from service.server.routes.errors import respond, tell_errors
from service.server.state import MESSAGE_BYTES, STARTING_S, AppState, app_state
from service.server.storage.database import DamagedFile
from service.server.storage.stores import storage
from service.system.background import report_callbacks, reported
from service.system.garbage import loaded
from service.system.memory import MemoryBudget

WEB = Path(__file__).parents[2] / "web"
PING_S = 15.0  # seconds between pings: proxies cut connections that are idle for a minute
KEEP_ALIVE_S = 150  # longer than proxies keep idle connections (Caddy two minutes), or they meet a closed one
TICKS = 10  # of uvicorn, which ticks ten times a second, between two checks of the connections
GRACE_S = 10  # for answers under way when the server ends
AGAIN_S = 1.0  # before it a second signal is ignored, as `timeout` sends two in a row; after it one ends at once
LAST_RESORT_S = 14.0  # from the signal to a forced end; operators count on 15
FULL = Unavailable("There is no room for another connection just now (SUNBOX_MAX_CONNECTIONS).", 5)

log = logging.getLogger(__name__)


def create_app(config: Config, places: Sequence[RendererSpec] = ()) -> FastAPI:
    """The service as an ASGI application. The renderers' processes start with its lifespan, if they were not started
    before on these `places`, and end with it."""
    stored = storage(config, lambda: store.pictures)
    store = RenderStore(config.data_dir, stored.quota.room, partial(stored.quota.room, reserved=True))
    memory = MemoryBudget(config.memory)
    state = AppState(
        config,
        stored,
        RequestReader(config, stored.assets, memory, stored.access),
        RendererPool(places or renderer_specs(config, memory.limit)) if config.ray is None else cluster_pool(config),
        RenderQueue(_limits(config), store),
    )
    app = FastAPI(
        title="Sunbox",
        version=metadata.version("sunbox-server"),
        description="A progressive path-tracing render service: JSON scenes in, converging pictures out.",
        lifespan=_lifespan,
        openapi_url=None,
        docs_url=None,
        redoc_url=None,
    )
    app.state.sunbox = state
    api = (
        info,
        preset_routes,
        assets,
        documents,
        renders,
        batches,
        callbacks,
        compare,
        materials,
        bsdf,
        export,
        stream,
    )
    for each in api:  # all but these know of stored renders, or need to know what their pictures take
        waits = [] if each in (info, preset_routes, stream) else [Depends(_loaded)]
        app.include_router(each.router, dependencies=waits)
    app.add_api_route("/docs", _docs, include_in_schema=False)
    describe(app, keyed=bool(config.api_key))
    app.mount("/", EditorFiles(directory=WEB, html=True))
    tell_errors(app)
    app.add_middleware(Compressed)
    app.add_middleware(Guard, config=config, refuse=respond)
    app.add_middleware(Pieces)
    app.add_middleware(Requests, refuse=respond, heard=state.traffic.heard)
    return app


def serve(config: Config, listener: socket.socket, most: int, places: Sequence[RendererSpec] = ()) -> int:
    """Print the address and serve until SIGINT or SIGTERM, with at most `most` connections; `places` as for
    `create_app`. Returns the exit code: 1 where it could not start."""
    host, port = listener.getsockname()[:2]
    try:
        app = create_app(config, places)
        state: AppState = app.state.sunbox
        state.storage.prepare()
    except (DamagedFile, CannotJoin) as error:
        log.error("did not start", {"reason": error})
        return 1
    state.address = f"http://{f'[{host}]' if ':' in host else host}:{port}/"
    server = _Server(server_settings(app, config, most), state)
    loaded()
    server.run([listener])
    return 1 if server.refused else 0


def server_settings(app: FastAPI, config: Config, most: int) -> uvicorn.Config:
    """uvicorn's settings, for at most `most` connections."""
    heard = app.state.sunbox.traffic.heard
    full = Requests(turning_away(FULL, respond), refuse=respond, heard=heard)
    proxies = config.trusted_proxies
    return uvicorn.Config(
        app,
        http=connection_class(most, open_for_health(app, full), proxies),
        proxy_headers=bool(proxies),  # by default uvicorn believes what anybody on 127.0.0.1 says
        forwarded_allow_ips=proxies,
        log_config=None,
        access_log=False,
        server_header=False,
        ws_per_message_deflate=False,
        ws_max_size=MESSAGE_BYTES,
        ws_ping_interval=PING_S,
        timeout_keep_alive=KEEP_ALIVE_S,
        timeout_graceful_shutdown=GRACE_S,
    )


class _Server(uvicorn.Server):
    """Prints its address once it answers; at its end it closes clients as going away, with exit code 0."""

    def __init__(self, config: uvicorn.Config, state: AppState) -> None:
        super().__init__(config)
        self._state = state
        self._watch = Watch()
        self._signalled_at: float | None = None
        self.refused = False

    async def on_tick(self, counter: int) -> bool:
        if counter % TICKS == 0:
            with reported("watch of connections"):
                self._watch.check(self.server_state.connections)
        if self._state.loading.failed:
            self.refused = self.should_exit = True
        return await super().on_tick(counter)

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        reason = await self._state.sandbox_missing() or await self._state.gpu_missing()
        if reason is not None:
            log.error("did not start", {"reason": reason})
            await self._state.renderers.close()
            await asyncio.to_thread(self._state.storage.assets.close)
            self.refused = self.should_exit = True
            return
        await super().startup(sockets)
        log.info("started", {"address": self._state.address, "version": metadata.version("sunbox-server")})
        _announce(self._state.address)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        log.info("shutting down", {"connections": len(self.server_state.connections)})
        await self._state.farewell()
        await super().shutdown(sockets)

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Handle signals until the end; uvicorn's own raises the signal again, which would be the exit code."""
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, self._end)
        yield

    def _end(self) -> None:
        if self._signalled_at is not None:
            if time.monotonic() - self._signalled_at > AGAIN_S:  # end at once; the other processes end with this one
                os._exit(int(self.refused))
            return
        self._signalled_at = time.monotonic()
        self.should_exit = True
        # Threads that pack a huge scene can't be interrupted, and Python waits for them.
        last_resort = threading.Timer(LAST_RESORT_S, os._exit, [0])
        last_resort.daemon = True
        last_resort.start()


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    state: AppState = app.state.sunbox
    state.renderers.start()
    state.storage.assets.start()
    report_callbacks(asyncio.get_running_loop())
    state.loading.tasks.start("check of the parsers' sandbox", _ask_for_rights(state))
    state.loading.start(state.resume_renders())
    state.loading.tasks.start("first frame", _warm(app))
    yield
    await state.farewell()
    await state.renderers.close()
    await asyncio.to_thread(state.storage.assets.close)
    state.bodies.close()
    if state.render_queue.store is not None:
        await state.render_queue.store.close()


async def _ask_for_rights(state: AppState) -> None:
    await asyncio.to_thread(state.storage.assets.rights)  # which logs them


async def _warm(app: FastAPI) -> None:
    """Render a first frame, repeat the address below what was logged meanwhile, and prepare for changes of scene."""
    state: AppState = app.state.sunbox
    if state.config.ahead == "off":
        return
    if not await warm_up(state.renderers, state.reader, presets.get("scenes", presets.DEFAULT_SCENE)):
        return
    _announce(state.address)
    await foresee(state.renderers, state.reader, *presets.likely())


def _announce(address: str) -> None:
    if address:
        sys.stdout.write(f"Ctrl-C stops the server. Sunbox is at {address}\n")
        sys.stdout.flush()


def _limits(config: Config) -> QueueLimits:
    retention = Retention(config.keep_renders, config.keep_bytes, config.keep_seconds)
    return QueueLimits(config.max_running, config.max_queue, config.max_jobs, retention, config.data_quota)


async def _loaded(connection: HTTPConnection) -> None:
    await app_state(connection).loading.wait(STARTING_S)


async def _docs() -> Response:
    return FileResponse(WEB / "docs.html")
