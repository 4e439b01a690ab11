"""No answer holds the event loop for long, which serves everybody: every GET with the largest that it may be about.

Work is counted, not timed. The bounds are some ms of one core.
"""

from __future__ import annotations

import asyncio
import json
import time
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.config import Config
from service.document import presets
from service.document.material import MODELS
from service.document.quality import resolve
from service.document.settings import Settings
from service.formats.images import LAYERS
from service.ipc.messages import Progress, View
from service.renderers.pool.pool import RendererPool
from service.server.app import create_app
from service.server.batches.batch import Batch, member_id
from service.server.http.guard import Keys
from service.server.readiness import Readiness
from service.server.renders.render import Render
from service.server.renders.store.batch_rows import BatchOrder
from service.server.renders.store.record import Order, Outcome
from service.server.renders.viewer import PictureViewer
from service.server.requests.request_parser import folded
from service.server.state import AppState
from service.server.storage import callback_rows, documents
from service.server.storage.database import Database
from tests.calls import loaded
from tests.counting import LoopWork
from tests.gltf_files import Gltf
from tests.service.rendering.fakes import load
from tests.serving import SCENE

MOST_LINES = 20_000  # of Python in a stretch: 2 to 5 ms
MOST_JSON = 1 << 15  # bytes that are written or read at once: 0.3 ms
RENDERS, BATCH = 2000, 10_000
PICTURES = 20  # of a batch: the others were cancelled
RENDERER = {"renderer": "none", "version": "", "software": True}
LONG = "x" * 150
SPHERE = {"type": "sphere", "center": [0, 0, 0], "radius": 0.001, "material": "ball"}
LARGE = {**SCENE, "shapes": [SPHERE] * 5000}
# What the largest answers of each path are about. A sheet of 10 000 pictures takes threads ten seconds, and the loop
# no more than one of a few: it is about a smaller batch.
ADDRESSES: dict[str, list[str]] = {
    "/healthz": [""],
    "/v1/compare/{name}": ["none"],  # two numbers, or nothing
    "/readyz": [""],
    "/metrics": [""],
    "/v1/info": [""],
    "/v1/schema": ["", *(f"?model={name}" for name in MODELS), "?model=openpbr&brief=true"],
    "/v1/presets/{kind}": list(presets.KINDS),
    "/v1/presets/{kind}/{name}": ["scenes/sphere-field", "scenes/disney-grid", "materials/skin"],
    "/v1/assets/{id}": ["{asset}"],
    "/v1/assets/{id}/scene": ["{asset}/scene"],
    "/v1/assets/{id}/materials": ["{asset}/materials"],
    "/v1/documents/{kind}": list(documents.KINDS),
    "/v1/documents/{kind}/{name}": ["scenes/large"],
    "/v1/renders": ["?limit=200", "?limit=200&state=failed", "?limit=200&label=none"],
    "/v1/renders/events": [""],
    "/v1/renders/{id}": ["{render}?kernel=true"],
    "/v1/renders/{id}/events": ["{render}/events"],
    "/v1/renders/{id}/scene": ["{render}/scene"],
    "/v1/renders/{id}/image": ["{render}/image?format=exr&aov=all", "{render}/image?format=npy"],
    "/v1/batches/{id}": ["{batch}"],
    "/v1/batches/{id}/images.zip": ["{batch}/images.zip"],
    "/v1/batches/{id}/sheet": ["{sheet}/sheet?width=8"],
    "/v1/batches/{id}/animation": ["{sheet}/animation?width=8"],
    "/v1/callbacks": ["?limit=200"],
    "/openapi.json": [""],
}


class Renderers(RendererPool):
    """Renders nothing, and says that it could."""

    def __init__(self) -> None:
        super().__init__([])

    @property
    def info(self) -> dict[str, Any]:
        return RENDERER

    async def ready(self, timeout_s: float) -> dict[str, Any]:
        return RENDERER


async def black(viewer: PictureViewer, view: View) -> tuple[np.ndarray, Progress]:
    channels = len(LAYERS[view.aov])
    return np.zeros((8, 8, channels), np.float32 if view.encoding == "linear" else np.uint8), Progress(8, 0.1, 1.0)


async def ready(readiness: Readiness) -> None: ...


def test_no_answer_holds_the_event_loop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PictureViewer, "image", black)
    monkeypatch.setattr(Readiness, "check", ready)
    monkeypatch.setattr("service.server.app.RendererPool", lambda *_: Renderers())

    async def run() -> None:
        app = create_app(Config(data_dir=tmp_path, api_key=["a"]))
        state: AppState = app.state.sunbox
        try:
            names = await filled(state, tmp_path)
            await loaded(state)
            described = {path for path, calls in app.openapi()["paths"].items() if "get" in calls}
            assert described | {"/openapi.json"} == ADDRESSES.keys(), "what is its largest answer about?"
            wrong = list[str]()
            for path, ends in ADDRESSES.items():
                start = path.partition("/{")[0]
                for end in ends:
                    address = f"{start}{'/' if end[:1] not in ('', '?') else ''}{end.format(**names)}"
                    wrong += await check(app, address)
            assert not wrong, "\n".join(wrong)
        finally:
            state.storage.assets.close()
            state.bodies.close()

    asyncio.run(run())


async def check(app: Any, address: str) -> list[str]:
    """What is wrong with an answer."""
    with LoopWork() as work:
        status = await asyncio.create_task(answered(app, address))
    assert status in (200, 204), address
    wrong = []
    if work.lines > MOST_LINES:
        wrong.append(f"{address}: {work.lines} lines at a stretch, most of them in {work.where}")
    if work.json_bytes > MOST_JSON:
        wrong.append(f"{address}: {work.json_bytes} bytes of JSON on the event loop")
    return wrong


async def answered(app: Any, address: str) -> int:
    """The status of a GET. One that has no end is left when it begins to be answered."""
    path, _, query = address.partition("?")
    headers = [(b"host", b"127.0.0.1"), (b"authorization", b"Bearer a"), (b"accept-encoding", b"gzip")]
    if path.count("/") == 3 and path.startswith("/v1/assets/"):
        headers.append((b"accept", b"application/json"))
    scope = {"type": "http", "method": "GET", "path": path, "raw_path": path.encode(), "query_string": query.encode()}
    scope |= {"headers": headers, "server": ("127.0.0.1", 80), "client": ("127.0.0.1", 1), "http_version": "1.1"}
    status = 0
    left, first = asyncio.Event(), True

    async def receive() -> Any:
        nonlocal first
        if first:
            first = False
            return {"type": "http.request", "body": b"", "more_body": False}
        await left.wait()
        return {"type": "http.disconnect"}

    async def send(message: Any) -> None:
        nonlocal status
        status = message.get("status", status)
        if path == "/v1/renders/events":
            left.set()

    await app(scope, receive, send)
    return status


async def filled(state: AppState, folder: Path) -> dict[str, str]:
    """Names of a render, a batch and an asset, in a service that has as much as it may."""
    state.storage.documents.prepare()
    owner = Keys(state.config.api_key).owner("Bearer a")
    queue, small, large = state.render_queue, folded(SCENE), folded(LARGE)
    outcome = Outcome(
        "done", "max_samples", Progress(8, 0.1, 1.0), warnings=[LONG] * 20, started_at=1.0, ended_at=2.0
    )
    settings = resolve(Settings(width=8, height=8))

    def job(id: str) -> Render:
        document = small if id.startswith(("b", "c")) else large
        made = Render(state.renderers, Order(id, owner, settings, LONG, 0, 1.0), load, document, outcome=outcome)
        queue._jobs[id] = made
        queue._number = made.number = queue._number + 1
        return made

    def batch(id: str, renders: int) -> Batch:
        values = [i / renders for i in range(renders)]
        axes = json.dumps([{"path": "/materials/ball/roughness", "values": values}])
        made = Batch(BatchOrder(id, owner, renders, axes))
        for step in range(renders):
            member = job(member_id(id, step))
            if step >= PICTURES:
                member.outcome = Outcome("cancelled", ended_at=2.0)
            made.add(step, member)
        state.batches._batches[id] = made
        return made

    large_batch, small_batch = batch("b" * 32, BATCH), batch("c" * 32, 50)
    for i in range(RENDERS):
        job(f"{i:032x}")
    with Database(folder).open() as database, database:
        for i in range(200):
            callback_rows.insert(database, "render", f"{i:032x}", owner, f"http://127.0.0.1:8000/{LONG}", time.time())
        for kind in documents.KINDS:
            rows = [(kind, f"{i}-{LONG[:90]}", owner, 0, LONG, 2, "{}") for i in range(documents.MOST_NAMES)]
            database.executemany("INSERT INTO documents VALUES (?, ?, ?, ?, ?, ?, ?)", rows)
        database.execute(
            "INSERT INTO documents VALUES ('scenes', 'large', ?, 0, 'l', 2, ?)", (owner, json.dumps(LARGE))
        )
    return {
        "render": f"{0:032x}",
        "batch": large_batch.id,
        "sheet": small_batch.id,
        "asset": await asyncio.to_thread(stored_model, state, owner),
    }


def stored_model(state: AppState, owner: str) -> str:
    """The id of a glTF file with many nodes, materials, variants and animations."""
    model = Gltf()
    for i in range(200):
        material = model.add("materials", {"name": f"{i}-{LONG}"})
        model.node(mesh=model.mesh(model.primitive(material=material)), name=f"{i}-{LONG}")
    file = state.storage.assets.incoming()
    with file:
        state.storage.assets.receive(file, model.glb())
        info = state.storage.assets.add(file, "model/gltf-binary", "model.glb", lambda *_: nullcontext())
    state.storage.shares.uploaded(owner, state.storage.assets.parts(info))
    return info.id
