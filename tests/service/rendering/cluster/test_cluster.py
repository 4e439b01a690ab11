"""Renderers as Ray actors, two of them on a real Ray: the same bits as here, also when one of them is lost."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Awaitable, Callable, Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from gpu import Renderer
from service.ipc.messages import Checkpoint, Done, Image, Read, StopRule, Update
from service.renderers.local.supervisor import Supervisor
from service.renderers.pool.pool import RendererPool
from service.renderers.ray import cluster as clusters
from service.renderers.ray.cluster import RESTS, Cluster
from tests.service.rendering.cluster.clusters import (
    ENDLESS,
    OPTIONS,
    SAMPLES,
    begun,
    descendants,
    kill,
    until,
    with_pool,
)
from tests.supervisors import LINEAR, Ears, with_supervisor

pytestmark = [pytest.mark.ray, pytest.mark.slow]

SECRET = "a key of callers"

Run = Callable[[Callable[[RendererPool], Awaitable[None]]], None]


@pytest.fixture(scope="module")
def cluster(gpu: Renderer) -> Iterator[Cluster]:
    """A cluster of this machine with two actors, which all tests of this file share."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SUNBOX_API_KEY", SECRET)
        found = Cluster("auto", 2, False, OPTIONS)
    assert found.joined.local and found.joined.renderers == 2
    yield found
    asyncio.run(found.close())


@pytest.fixture(scope="module")
def run(cluster: Cluster) -> Iterator[Run]:
    """Runs a test with these actors."""
    with asyncio.Runner() as runner:
        yield lambda test: runner.run(with_pool(cluster, test))


@pytest.fixture(scope="module")
def expected(gpu: Renderer) -> np.ndarray:
    """The picture of a renderer of this machine."""
    found = []

    async def test(supervisor: Supervisor) -> None:
        task, ears = await begun(supervisor)
        await ears.next(Done)
        found.append(await picture(supervisor, task, ears))

    with_supervisor(test)
    return found[0]


async def picture(renderers: RendererPool | Supervisor, task: int, ears: Ears) -> np.ndarray:
    renderers.send(Read(task, 1, LINEAR))
    return np.array((await ears.next(Image)).pixels)


def restarts(pool: RendererPool, cause: str) -> int:
    return sum(member.statistics.restarts[cause] for member in pool.members)


def test_actors_render_the_same_bits(run: Run, expected: np.ndarray) -> None:
    async def test(pool: RendererPool) -> None:
        await until(lambda: all(member.state == "ready" for member in pool.members))
        for task, ears in [await begun(pool), await begun(pool)]:
            assert (await ears.next(Done)).saved is not None
            assert np.array_equal(expected, await picture(pool, task, ears))

    run(test)


def test_a_gateway_that_hangs_is_replaced(run: Run, cluster: Cluster, monkeypatch: pytest.MonkeyPatch) -> None:
    async def test(pool: RendererPool) -> None:
        assert pool.process_id is not None
        before = pool.process_id
        await asyncio.sleep(1.2)  # past its first sign of life
        monkeypatch.setattr(clusters, "SILENT_S", 2.5)
        os.kill(before, signal.SIGSTOP)
        await until(lambda: restarts(pool, "node lost") >= 2)
        monkeypatch.undo()
        await pool.ready(60)
        assert pool.process_id not in (None, before)

    run(test)


def test_callers_keys_stay_with_the_server(run: Run) -> None:
    async def test(pool: RendererPool) -> None:
        assert pool.process_id is not None
        everybody = [pool.process_id, *descendants(pool.process_id, "")]
        assert len(everybody) > 5
        for pid in everybody:
            with suppress(OSError):  # it has just ended
                assert SECRET.encode() not in Path(f"/proc/{pid}/environ").read_bytes()

    run(test)


def test_a_cluster_of_ones_own_is_closed_to_others(run: Run, cluster: Cluster) -> None:
    """It listens on the loopback address alone, and its files are its user's."""

    async def test(pool: RendererPool) -> None:
        assert cluster.joined.address.startswith("127.0.0.1:") and pool.process_id is not None
        found = {address for pid in descendants(pool.process_id, "") for address in listening(pid)}
        assert found and all(address.endswith("0100007F") for address in found), found  # 127.0.0.1, also within IPv6
        status = Path(f"/proc/{pool.process_id}/status").read_text()
        assert "\nUmask:\t0077\n" in status

    run(test)


def listening(pid: int) -> Iterator[str]:
    """The addresses at which a process takes TCP connections, in hexadecimal as the kernel writes them."""
    sockets = set[str]()
    with suppress(OSError):  # it has just ended, or is hidden, as renderers are
        for descriptor in Path(f"/proc/{pid}/fd").iterdir():
            with suppress(OSError):
                sockets.add(os.readlink(descriptor))
    for name in ("tcp", "tcp6"):
        for line in Path(f"/proc/net/{name}").read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] == "0A" and f"socket:[{fields[9]}]" in sockets:
                yield fields[1].partition(":")[0]


def test_actors_divide_a_render(run: Run) -> None:
    async def test(pool: RendererPool) -> None:
        await until(lambda: all(member.state == "ready" for member in pool.members))
        before = [member.statistics.samples for member in pool.members]
        task, ears = await begun(pool, 1000)
        await ears.next(Done)
        divided = await picture(pool, task, ears)
        traced = [member.statistics.samples - old for member, old in zip(pool.members, before, strict=True)]
        assert min(traced) > 0
        pictures.append(divided)

    async def alone(supervisor: Supervisor) -> None:
        task, ears = await begun(supervisor, 1000)
        await ears.next(Done)
        pictures.append(await picture(supervisor, task, ears))

    pictures = list[np.ndarray]()
    run(test)
    with_supervisor(alone)
    assert np.array_equal(*pictures)


@pytest.mark.parametrize(("word", "cause"), [("service.worker", "killed"), ("ray::Renderer", "node lost")])
def test_a_render_goes_on_where_its_renderer_is_killed(run: Run, expected: np.ndarray, word: str, cause: str) -> None:
    async def test(pool: RendererPool) -> None:
        assert pool.process_id is not None
        task, ears = await begun(pool, ENDLESS)
        await ears.next(Checkpoint)
        for pid in descendants(pool.process_id, word):
            kill(pid)
        await until(lambda: restarts(pool, cause) == 2)
        pool.send(Update(task, 2, stop=StopRule(SAMPLES), base=1))
        assert (await ears.next(Done)).progress.samples == SAMPLES
        assert np.array_equal(expected, await picture(pool, task, ears))

    run(test)


def test_a_renderer_that_is_not_needed_is_given_back(run: Run, cluster: Cluster, expected: np.ndarray) -> None:
    async def test(pool: RendererPool) -> None:
        assert pool.process_id is not None
        await until(lambda: all(member.state == "ready" for member in pool.members))
        cluster.release_node(1)
        await until(lambda: restarts(pool, "released") == 1 and pool.supervisors[1].waiting == RESTS)
        await until(lambda: len(descendants(pool.process_id or 0, "ray::Renderer")) == 1)
        task, ears = await begun(pool)
        await ears.next(Done)
        assert np.array_equal(expected, await picture(pool, task, ears))
        cluster.wake(1)
        await until(lambda: all(member.state == "ready" for member in pool.members))

    run(test)
