"""A cluster that grows, shrinks to nothing, and loses nodes with and without a warning."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

import pytest

from gpu import Renderer
from service.ipc.messages import Checkpoint, Progressed
from service.problems import Unavailable
from service.renderers.pool.pool import RendererPool
from service.renderers.ray.cluster import Cluster
from tests.service.rendering.cluster.clusters import ENDLESS, OPTIONS, Nodes, begun, renderer_specs, until

pytestmark = [pytest.mark.ray, pytest.mark.slow]


@pytest.fixture(scope="module")
def nodes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Nodes]:
    """A cluster whose head renders nothing; nodes are added and removed."""
    cluster = Nodes(tmp_path_factory.mktemp("nodes"))
    yield cluster
    cluster.close()


def test_it_shrinks_to_nothing_and_grows(gpu: Renderer, nodes: Nodes) -> None:
    async def test() -> None:
        cluster = Cluster(nodes.address, 1, False, OPTIONS, nodes_s=0.0)
        pool = RendererPool(renderer_specs(cluster))
        pool.start()
        try:
            await until(lambda: pool.waiting)
            with pytest.raises(Unavailable, match="no node with 1 CPU free for a renderer"):
                await pool.ready(0)
            node = nodes.add()
            await pool.ready(90)
            _, ears = await begun(pool, ENDLESS)
            await ears.next(Checkpoint)
            nodes.remove(node)
            await until(lambda: pool.info is None)
            while not ears.messages.empty():
                ears.messages.get_nowait()
            nodes.add()
            assert (await ears.next(Progressed)).progress.samples > 0
            (last,) = nodes.rendering()
            nodes.drain(last)
            await until(lambda: pool.members[0].statistics.restarts == {"node lost": 1, "drained": 1})
        finally:
            await pool.close()
            await cluster.close()

    asyncio.run(test())
