"""A pool of renderers that are all actors of one Ray cluster, of which it takes as many as there is work for."""

from __future__ import annotations

import asyncio
import time

from service.config import Config
from service.renderers.local.process import Options
from service.renderers.pool.pool import RendererPool, RendererSpec
from service.renderers.protocol import Place
from service.renderers.ray.cluster import Cluster
from service.system.background import Background, reported

LOOK_S = 1.0  # between two looks at how much work there is
LONG_S = 10.0  # of work, after which all renderers are asked for: they divide it
IDLE_S = 300.0  # without work, after which one renderer is kept: less time than starting nodes takes would not pay


class ClusterPool(RendererPool):
    """Fulfils `Renderers`. A renderer for which there is no work is given back to the cluster, whose autoscaler may
    then remove the node; where there is work again, it is asked for again, which makes the autoscaler add one.

    Its end is the gateway's end, too, and that of a cluster which was started for it.
    """

    def __init__(self, cluster: Cluster) -> None:
        self._cluster = cluster
        self._count = cluster.joined.renderers
        self._busy_since: float | None = None
        self._idle_since = time.monotonic()
        self._chores = Background()
        self._looking: asyncio.Task[None] | None = None
        options = Options(patience_s=cluster.options["patience_s"])
        super().__init__(
            [RendererSpec(Place(str(n), cluster.device, ""), options, cluster.starter(n)) for n in range(self._count)]
        )
        for number in range(max(1, cluster.joined.room), self._count):  # nodes are added for work, not for a start
            cluster.release_node(number)

    def start(self) -> None:
        super().start()
        if self._looking is None:
            self._looking = self._chores.start("look at the cluster's load", self._look())

    async def close(self) -> None:
        if self._looking is not None:
            self._looking.cancel()
        await super().close()
        await self._cluster.close()

    async def _look(self) -> None:
        while True:
            await asyncio.sleep(LOOK_S)
            with reported("look at the cluster's load"):
                self.resize(time.monotonic())

    def resize(self, now: float) -> None:
        """Ask the cluster for as many renderers as there are tasks; for all when work lasts, for one after none."""
        active = sum(task.active for each in self.supervisors for task in each.tasks.values())
        if active:
            self._idle_since = now
            self._busy_since = self._busy_since or now
            wanted = self._count if now - self._busy_since >= LONG_S else active
            resting = sorted(self._cluster.resting)
            for number in resting[: max(0, wanted - (self._count - len(resting)))]:
                self._cluster.wake(number)
            return
        self._busy_since = None
        if now - self._idle_since >= IDLE_S:
            awake = [number for number in range(self._count) if number not in self._cluster.resting]
            stays = next((number for number in awake if self.supervisors[number].info is not None), awake[0])
            for number in awake:
                if number != stays:
                    self._cluster.release_node(number)


def cluster_pool(config: Config) -> ClusterPool:
    """The renderers of SUNBOX_RAY. Raises CannotJoin, within half a minute at most."""
    assert config.ray is not None
    # The memory of a node is its own: SUNBOX_MEMORY is about this machine.
    options = {
        "patience_s": config.hang_s,
        "memory": config.gpu_memory,
        "checkpoint_s": config.checkpoint_s,
        "ahead": config.ahead,
        "nice": config.nice,
    }
    return ClusterPool(Cluster(config.ray, config.ray_renderers, config.require_gpu, options))
