"""A pool of renderers that are all actors of one Ray cluster."""

from __future__ import annotations

from service.config import Config
from service.rendering.cluster.cluster import Cluster
from service.rendering.renderers import Place
from service.rendering.supervisor.pool import Pool, Seat
from service.rendering.supervisor.process import Options


class ClusterPool(Pool):
    """Fulfils `Renderers`. Its end is the gateway's end, too, and that of a cluster which was started for it."""

    def __init__(self, cluster: Cluster) -> None:
        self._cluster = cluster
        options = Options(patience_s=cluster.options["patience_s"])
        numbers = range(cluster.joined.renderers)
        super().__init__([Seat(Place(str(n), cluster.device, ""), options, cluster.starter(n)) for n in numbers])

    async def close(self) -> None:
        await super().close()
        await self._cluster.close()


def cluster_pool(config: Config) -> ClusterPool:
    """The renderers of SUNBOX_RAY. Raises CannotJoin, within half a minute at most."""
    assert config.ray is not None
    # The memory of a node is its own: SUNBOX_MEMORY is about this machine.
    options = {"patience_s": config.hang_s, "memory": config.gpu_memory, "checkpoint_s": config.checkpoint_s}
    return ClusterPool(Cluster(config.ray, config.ray_renderers, config.require_gpu, options))
