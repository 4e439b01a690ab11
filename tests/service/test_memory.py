"""One budget for the memory of all work: who would exceed it is refused, and caches give way."""

from __future__ import annotations

import asyncio
import gc
import json
import os
from collections.abc import Iterator
from contextvars import copy_context
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.requests import Request

from service.config import MIB, Config
from service.document.text import most_bytes
from service.formats import ImageData
from service.formats.cache import ParsedCache
from service.formats.types import AssetLimits
from service.pack import RENDERED_PIXEL_BYTES, SAVED_PIXEL_BYTES, CacheBudget, PackCache
from service.problems import TooLarge, TooManyRequests, Unavailable
from service.server.app import create_app
from service.server.assets import AssetStore
from service.server.requests.bodies import Bodies
from service.server.requests.request_reader import RequestReader
from service.server.streams import protocol
from service.server.streams.edit_session import EditSession
from service.system import memory
from service.system.memory import Limit, MemoryBudget, machine_memory
from service.system.shares import CALLER
from tests.calls import metrics
from tests.serving import PATIENCE_S, SCENE, Client, Server, served, wait_until


class Work:
    """Something that holds bytes."""


def test_bytes_count_until_they_are_released() -> None:
    budget, first, second = MemoryBudget(100), Work(), Work()
    budget.hold("scenes", first, 60)
    budget.hold("pictures", first, 10)
    with pytest.raises(Unavailable, match="SUNBOX_MEMORY"):
        budget.hold("scenes", second, 31)
    budget.hold("scenes", second, 30)
    assert budget.used() == {"bodies": 0, "documents": 0, "scenes": 90, "pictures": 10, "assets": 0}
    with pytest.raises(Unavailable):
        budget.hold("scenes", first, 61)
    assert budget.used()["scenes"] == 90  # as before
    budget.hold("scenes", first, 20)
    budget.release(second)
    with budget.reserved("bodies", 70):
        assert sum(budget.used().values()) == 100
    with pytest.raises(TooLarge, match="SUNBOX_MEMORY"):
        budget.hold("scenes", second, 101)
    del first
    gc.collect()
    assert sum(budget.used().values()) == 0


def test_callers_share_what_a_limit_allows() -> None:
    """And what they use of it counts in its category, beside what is not limited."""
    budget, limit = MemoryBudget(1000), Limit("bodies", 100, "bodies (SUNBOX_SOME)")
    works = [Work() for _ in range(4)]

    def hold(caller: str, index: int, size: int) -> None:
        copy_context().run(lambda: (CALLER.set(caller), budget.hold(limit, works[index], size)))

    hold("first", 0, 40)
    with pytest.raises(TooManyRequests, match="SUNBOX_SOME"):
        hold("first", 1, 11)
    hold("second", 2, 25)
    with pytest.raises(Unavailable, match="SUNBOX_SOME"):
        hold("third", 3, 18)
    with pytest.raises(TooLarge, match="SUNBOX_SOME"):
        hold("third", 3, 51)
    budget.hold("bodies", works[3], 100)
    assert budget.used()["bodies"] == 165
    hold("first", 0, 10)
    hold("second", 0, 32)  # still the first caller's: another 22 would be more than the second one's share
    hold("first", 0, 1)
    hold("first", 1, 30)
    del works[2]
    gc.collect()
    assert budget.used()["bodies"] == 131
    with budget.growing(limit) as grow:
        grow(20)
        grow(10)
        assert budget.used()["bodies"] == 141
    assert budget.used()["bodies"] == 131


def test_caches_give_way_to_work() -> None:
    budget, kept = MemoryBudget(100), [80]

    def shrink(size: int) -> None:
        kept[0] -= min(kept[0], size)

    budget.cache("assets", lambda: kept[0], shrink)
    with budget.reserved("bodies", 20):
        assert kept == [80]
    with budget.reserved("bodies", 50):
        assert kept == [50] and budget.used()["assets"] == 50


def test_the_caches_can_be_shrunk() -> None:
    parsed = ParsedCache(AssetLimits())
    for name in "abc":
        parsed.load(name, lambda: ImageData(np.zeros((10, 10, 1), np.uint8), ()))
    parsed.shrink(150)
    assert parsed.bytes == 100
    parsed.close()

    class Part:
        def __init__(self) -> None:
            self.array = np.zeros(1000, np.uint8)

    packed = CacheBudget()
    caches = [PackCache(budget=packed), PackCache(budget=packed)]
    for key in range(3):
        caches[0].get(key, Part)
    caches[1].get(0, Part)
    packed.shrink(1001)
    assert (caches[0].bytes, caches[1].bytes) == (1000, 1000)
    packed.shrink(10**6)
    assert packed.bytes == 2000  # what was made last is in use


@pytest.mark.parametrize(
    ("group", "files", "limit"),
    [
        ("0::/", {"memory.max": "1000000"}, 1000000),
        ("0::/", {"memory.max": "max"}, None),
        ("0::/system.slice/sunbox.service", {"system.slice/sunbox.service/memory.max": "5000"}, 5000),
        ("0::/outer/inner", {"outer/inner/memory.max": "5000", "outer/memory.max": "4000"}, 4000),
        ("0::/docker/abc", {"memory.max": "3000"}, 3000),  # seen from inside of it
        ("0::/../other", {}, None),
        ("7:memory:/lxc\n5:cpu:/lxc\n0::/", {"memory/lxc/memory.limit_in_bytes": "9000"}, 9000),
        ("nonsense", {"memory.max": "1"}, None),
    ],
)
def test_a_container_s_limit_counts(
    group: str, files: dict[str, str], limit: int | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(memory, "CGROUP", tmp_path / "groups")
    monkeypatch.setattr(memory, "PROCESS_CGROUP", tmp_path / "own")
    machine = machine_memory()
    assert machine == os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    (tmp_path / "own").write_text(group + "\n")
    for name, text in files.items():
        (tmp_path / "groups" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "groups" / name).write_text(text)
    assert machine_memory() == (limit or machine)
    assert MemoryBudget().limit == machine_memory() // 2


@pytest.fixture
def assets(tmp_path: Path) -> Iterator[AssetStore]:
    store = AssetStore(tmp_path)
    yield store
    store.close()


HEIGHT = 400


def start(width: int, generation: int) -> protocol.Start:
    settings = {"width": width, "height": HEIGHT, "max_samples": 1}
    return protocol.Start(type="start", generation=generation, scene=SCENE, settings=settings)


def edit(session: EditSession, message: protocol.Start) -> None:
    session.take(message)
    session.pack_pending()


def test_a_stream_s_picture_and_scene_count(assets: AssetStore) -> None:
    budget = MemoryBudget(200 * HEIGHT * RENDERED_PIXEL_BYTES + 1_200_000)  # with the scenes of two
    reader = RequestReader(Config(), assets, budget)
    session, other = EditSession(reader, 1), EditSession(reader, 2)
    edit(session, start(100, 1))
    used = budget.used()
    assert used["pictures"] == 100 * HEIGHT * RENDERED_PIXEL_BYTES and used["scenes"] and used["documents"]
    with pytest.raises(TooLarge, match="SUNBOX_MEMORY"):
        edit(session, start(300, 2))
    with pytest.raises(Unavailable, match="SUNBOX_MEMORY"):
        edit(other, start(120, 1))
    assert budget.used()["pictures"] == used["pictures"]
    edit(session, start(50, 3))
    edit(other, start(120, 2))
    assert budget.used()["pictures"] == 170 * HEIGHT * RENDERED_PIXEL_BYTES
    session.close()
    other.close()
    assert sum(budget.used().values()) - reader.caches.bytes == 0


def test_a_body_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    budget = MemoryBudget(13 * MIB // 2)  # both texts, and the values of one
    bodies = Bodies(Config(), budget)

    text = b'{"material": {"type": "diffuse", "albedo": 0.5}, "to": "openpbr"}'.ljust(2 * MIB)

    async def receive() -> dict[str, Any]:
        return {"type": "http.request", "body": text, "more_body": False}

    async def take(inner: bool) -> None:
        async def ready(body: bytearray) -> None:
            assert budget.used()["bodies"] >= 2 * MIB
            if inner:
                await take(False)

        request = Request({"type": "http", "method": "POST", "headers": []}, receive)
        async with bodies.read(request, "conversion", "", ready) as converted:
            assert converted.material["type"] == "openpbr"
            assert budget.used()["bodies"] >= most_bytes(text)

    asyncio.run(take(True))
    assert budget.used()["bodies"] == 0
    with budget.reserved("scenes", MIB), pytest.raises(Unavailable, match="SUNBOX_MEMORY"):
        asyncio.run(take(True))
    assert budget.used()["bodies"] == 0
    bodies.close()


@pytest.fixture(scope="module")
def tight(gpu: object, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server that has so little memory that few other tests could pass with it."""
    with served(tmp_path_factory.mktemp("tight"), SUNBOX_MEMORY=str(96 * MIB)) as server:
        yield server


def test_a_server_says_what_it_holds(tight: Server) -> None:
    with Client(tight.url) as client:
        assert client.until("hello")
        client.start(settings={"width": 128, "height": 64, "max_samples": 1})
        client.finished()
        info = tight.http.get("/v1/info").json()
        assert info["memory"]["limit"] == info["renderer"]["memory_limit"] == 96 * MIB
        assert info["memory"]["used"]["pictures"] == 128 * 64 * RENDERED_PIXEL_BYTES
        found = metrics(tight)
        assert found['sunbox_memory_bytes{owner="pictures"}'] == 128 * 64 * RENDERED_PIXEL_BYTES
        assert found["sunbox_memory_limit_bytes"] == 96 * MIB
        client.start(2, settings={"width": 1200, "height": 1024, "max_samples": 1})
        told = client.until("error")[0]
        assert told["generation"] == 2 and told["problem"]["status"] == 413
        assert "SUNBOX_MEMORY" in told["problem"]["detail"]


def test_the_session_server_is_within_its_memory(server: Server) -> None:
    info = server.http.get("/v1/info").json()
    assert sum(info["memory"]["used"].values()) < info["memory"]["limit"] == MemoryBudget().limit


def test_renders_wait_for_memory(tight: Server) -> None:
    """A stored one goes on when there is some; who waits for the answer is told to come again."""

    def body(size: int, samples: int) -> dict[str, Any]:
        return {"scene": SCENE, "settings": {"width": size, "height": size, "max_samples": samples}}

    def pictures() -> int:
        return int(tight.http.get("/v1/info").json()["memory"]["used"]["pictures"])

    stream = pictures()  # that may come back
    each = 500 * 500 * (RENDERED_PIXEL_BYTES + SAVED_PIXEL_BYTES)
    for route in ("/v1/renders", "/v1/render"):
        refused = tight.http.post(route, json=body(1024, 1))
        assert refused.status_code == 413 and "SUNBOX_MEMORY" in refused.json()["detail"]
    first = tight.http.post("/v1/renders", json=body(500, 1 << 24)).json()["id"]
    wait_until(lambda: tight.http.get(f"/v1/renders/{first}").json()["samples"] > 0)
    second = tight.http.post("/v1/renders", json=body(500, 1)).json()["id"]
    refused = tight.http.post("/v1/render", json=body(500, 1))
    assert refused.status_code == 503 and int(refused.headers["retry-after"]) > 0
    assert pictures() == stream + each
    assert tight.http.get(f"/v1/renders/{second}").json()["state"] == "queued"
    tight.http.delete(f"/v1/renders/{first}")  # it rests with the renderer, and makes room
    assert tight.http.get(f"/v1/renders/{second}?wait={PATIENCE_S}").json()["state"] == "done"
    assert pictures() == stream + each
    for id in (first, second):  # from the disk, one after the other
        assert tight.http.get(f"/v1/renders/{id}/image").status_code == 200


# How each call that answers with pictures shows renders of a batch, {last} being the one after {first}: the path and
# the body, or None where the picture is of no render that is kept.
SHOWS: dict[str, tuple[str, Any] | None] = {
    "GET /v1/renders/{id}/image": ("/v1/renders/{last}/image?format=npy", None),
    "GET /v1/batches/{id}/images.zip": ("/v1/batches/{batch}/images.zip?format=npy", None),
    "GET /v1/batches/{id}/sheet": ("/v1/batches/{batch}/sheet?width=16", None),
    "GET /v1/batches/{id}/animation": ("/v1/batches/{batch}/animation?format=gif&width=16", None),
    "POST /v1/compare": ("/v1/compare?format=png", {"a": "{first}", "b": "{last}"}),
    "POST /v1/render": None,
    "POST /v1/export": None,
    "GET /v1/assets/{id}": None,
}
PICTURES = ("image/", "video/", "application/zip", "application/octet-stream")


def shows_pictures() -> set[str]:
    """The calls whose answers may have a picture, by the API's description."""
    return {
        f"{method.upper()} {path}"
        for path, methods in create_app(Config()).openapi()["paths"].items()
        for method, call in methods.items()
        for answer in call["responses"].values()
        if any(mime.startswith(PICTURES) for mime in answer.get("content", {}))
    }


def _named(value: Any, **names: str) -> Any:
    """A JSON value with names in the places of {name}."""
    text = json.dumps(value)
    for name, meant in names.items():
        text = text.replace(f"{{{name}}}", meant)
    return json.loads(text)


def test_pictures_that_are_shown_make_room(tight: Server) -> None:
    """By each call that shows them, more than fit into the memory; then another render takes most of it."""
    assert shows_pictures() == SHOWS.keys(), "a call that shows pictures is asked here, too"
    size, count, each = 260, 7, RENDERED_PIXEL_BYTES + SAVED_PIXEL_BYTES
    assert (count - 1) * size**2 * each > 96 * MIB
    settings = {"width": size, "height": size, "max_samples": 2}
    body = {"scene": SCENE, "settings": settings, "over": [{"turntable": count}]}
    batch = tight.http.post("/v1/batches", json=body).json()["id"]
    found = tight.http.get(f"/v1/batches/{batch}?wait={PATIENCE_S}").json()
    assert found["state"] == "done"
    ids = [render["id"] for render in found["renders"]]
    for asked in filter(None, SHOWS.values()):
        for first, last in pairwise(ids):
            path, sent = (_named(part, first=first, last=last, batch=batch) for part in asked)
            answer = tight.http.get(path) if sent is None else tight.http.post(path, json=sent)
            assert answer.status_code == 200, (asked, answer.text)
            if "{last}" not in str(asked):
                break  # it shows all of them
        resting = metrics(tight)["sunbox_resting_bytes"]
        assert 0 < resting <= sum(tight.http.get("/v1/info").json()["memory"]["used"].values()) <= 96 * MIB
        large = {"width": 500, "height": 500, "max_samples": 1}
        answer = tight.http.post("/v1/render", json={"scene": SCENE, "settings": large})
        assert answer.status_code == 200, (asked, answer.text)
        assert metrics(tight)["sunbox_resting_bytes"] <= 96 * MIB - 500**2 * each < resting
