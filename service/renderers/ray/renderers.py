"""How many renderers a cluster is asked for, and what is declared to Ray for each of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

Resources = dict[str, float]


def plan(nodes: Sequence[Mapping[str, float]], wanted: int | None, gpu: bool = False) -> tuple[int, Resources]:
    """The number of renderers for nodes with these resources, and what each declares.

    Where there are GPUs, or `gpu` demands them, a renderer has one, and a processor for what it does beside it;
    without `wanted` there is one renderer a GPU. Else renderers share the processors evenly; without `wanted` there
    is one renderer a node. More may be wanted than have room now: Ray places the others when the cluster grows.
    """
    gpus = sum(int(node.get("GPU", 0)) for node in nodes)
    if gpus or gpu:
        return wanted or max(gpus, 1), {"GPU": 1.0, "CPU": 1.0}
    processors = [int(node.get("CPU", 0)) for node in nodes if node.get("CPU", 0) >= 1]
    number = wanted or max(len(processors), 1)
    shares = range(max(processors, default=1), 0, -1)
    share = next((k for k in shares if sum(have // k for have in processors) >= number), 1)
    return number, {"CPU": float(share)}


def room(nodes: Sequence[Mapping[str, float]], resources: Resources) -> int:
    """How many renderers that declare these resources have room on such nodes, if nobody else uses them."""
    return sum(min(int(node.get(name, 0) // count) for name, count in resources.items()) for node in nodes)


def described(resources: Mapping[str, float]) -> str:
    """The resources in words: "1 GPU and 2 CPU"."""
    return " and ".join(f"{count:g} {name}" for name, count in sorted(resources.items(), reverse=True))
