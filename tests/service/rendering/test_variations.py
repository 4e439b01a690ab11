"""Renders that stand on one document, each with a merge patch: what is stored, what is rendered, what is packed."""

from __future__ import annotations

import asyncio
import json
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from service.config import Config
from service.document import merge_patch
from service.document.document import Parsed
from service.pack import Packed
from service.problems import InvalidDocument
from service.server.renders import slots
from service.server.renders.queue import RenderQueue
from service.server.renders.render import Render
from service.server.renders.scene import PackedScenes
from service.server.renders.store.check import check_renders
from service.server.renders.store.record import Order, Outcome
from service.server.renders.store.store import RenderStore
from service.server.requests.request_parser import folded, unfolded
from service.server.requests.request_reader import RequestReader
from service.server.storage.asset_access import NO_USES
from service.server.storage.data_check import Report
from service.server.storage.database import FILE
from tests.documents import Shelf
from tests.queues import LIMITS
from tests.service.rendering.fakes import PACKED, SETTINGS, Quick, until
from tests.serving import SCENE

PATCHES = [{"camera": {"vfov": vfov}} for vfov in (20, 30, 40)]


def documents(folder: Path) -> int:
    with closing(sqlite3.connect(folder / FILE)) as file:
        return int(file.execute("SELECT count(*) FROM render_documents").fetchone()[0])


def test_a_document_is_stored_once_and_each_render_has_its_own_scene(tmp_path: Path) -> None:
    rendered = list[Any]()

    async def load(document: bytes, count: Callable[[int], None]) -> Packed:
        rendered.append(json.loads(unfolded(document)))
        return PACKED

    async def scenario() -> None:
        store, renderers, base = RenderStore(tmp_path), Quick(), folded(SCENE)
        renderers.hopeless = True
        queue = RenderQueue(LIMITS, store)
        for number, patch in enumerate(map(folded, PATCHES)):
            order = Order(f"{number}", "", SETTINGS, bytes=len(patch) if number else len(base))
            first = queue.get("0").number if number else None
            await queue.submit(Render(renderers, order, load, base, patch=patch, base=first))  # type: ignore[arg-type]
        assert documents(tmp_path) == 1 and rendered == []
        report = Report()
        assert check_renders(tmp_path, report) == 3 and report.faults == []
        await queue.close()

        store, renderers = RenderStore(tmp_path), Quick()  # the next server's
        queue = RenderQueue(LIMITS, store)
        queue.resume(store.load(), lambda stored: Render(renderers, stored.order, load, outcome=stored.outcome))  # type: ignore[arg-type]
        jobs = (await queue.page()).renders
        await until(lambda: all(job.state == "done" for job in jobs))
        scenes = [merge_patch(SCENE, patch) for patch in PATCHES]
        assert sorted(rendered, key=lambda scene: scene["camera"]["vfov"]) == scenes
        assert [json.loads(unfolded(await job.document())) for job in reversed(jobs)] == scenes
        for job, left in zip(reversed(jobs), (1, 1, 0), strict=True):  # it stays for the last one
            assert documents(tmp_path) == 1
            await queue.delete(job)
            assert documents(tmp_path) == left
        await queue.close()

    asyncio.run(scenario())


def test_a_document_that_is_gone_is_stored_again(tmp_path: Path) -> None:
    async def scenario() -> None:
        store = RenderStore(tmp_path)
        first = await store.insert(Order("a", "", SETTINGS), Outcome(), folded(SCENE), NO_USES)
        await store.forget([(first, "a")])
        patch = folded(PATCHES[0])
        number = await store.insert(
            Order("b", "", SETTINGS), Outcome(), folded(SCENE), NO_USES, patch=patch, base=first
        )
        assert json.loads(unfolded(await store.document(number))) == merge_patch(SCENE, PATCHES[0])

    asyncio.run(scenario())


def test_only_what_a_patch_changes_is_validated() -> None:
    reader = RequestReader(Config(), Shelf())
    base = Parsed(SCENE, reader.scene(SCENE))
    scene = reader.scene(merge_patch(SCENE, PATCHES[0]), base)
    assert scene.camera.vfov == 20 and all(a is b for a, b in zip(scene.shapes, base.scene.shapes, strict=True))
    with pytest.raises(InvalidDocument) as refused:
        reader.scene(merge_patch(SCENE, {"camera": {"vfov": 0}}), base)
    assert [error.pointer for error in refused.value.errors] == ["/scene/camera/vfov"]


def test_what_waits_is_packed_once_where_there_is_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slots, "LOOK_S", 0.005)
    monkeypatch.setattr(slots, "AGAIN_S", 0.01)
    packed = list[bytes]()

    async def load(document: bytes, count: Callable[[int], None]) -> Packed:
        packed.append(document)
        return PACKED

    async def scenario() -> None:
        renderers: Any = Quick()
        queue = RenderQueue(LIMITS, RenderStore(tmp_path))
        one = Render(renderers, Order("size", "", SETTINGS), load, b"", PACKED).scene.memory.scene_bytes
        waiting = PackedScenes(2 * one)
        renderers.hopeless = True
        jobs = [
            Render(renderers, Order(id, "", SETTINGS), load, id.encode(), PACKED, waiting=waiting)
            for id in ("first", "second", "no room", "cancelled")
        ]
        for job in jobs:
            await queue.submit(job)
        assert waiting.bytes == 2 * one
        queue.cancel(jobs[3])
        waiting.shrink(1)  # the second one is the last that is packed
        renderers.hopeless = False
        await until(lambda: all(job.state == "done" for job in jobs[:3]))
        assert sorted(packed) == [b"no room", b"second"] and waiting.bytes == 0
        await queue.close()

    asyncio.run(scenario())
