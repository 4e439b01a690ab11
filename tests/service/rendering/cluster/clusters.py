"""A Ray cluster on this machine, and its processes."""

from __future__ import annotations

import asyncio
import os
import socket
import subprocess
import sys
import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import suppress
from pathlib import Path

from service.ipc.messages import StopRule, Update
from service.renderers.local.process import Options
from service.renderers.local.supervisor import Supervisor
from service.renderers.pool.pool import RendererPool, RendererSpec
from service.renderers.protocol import Place
from service.renderers.ray.cluster import Cluster
from tests.supervisors import Ears, arrays_of, settings

LIST_NODES = """
import sys, ray
ray.init(sys.argv[1], log_to_driver=False)
for node in ray.nodes():
    if node["Alive"] and node["Resources"].get("CPU"):
        print("node", node["NodeID"])
"""
# How soon a head gives up a node that does not answer: by default after half a minute.
QUICK = {"RAY_health_check_period_ms": "500", "RAY_health_check_failure_threshold": "2"}
SAMPLES = 400
ENDLESS = 1 << 24
OPTIONS = {"patience_s": 10.0, "checkpoint_s": 0.05, "ahead": "off"}


async def begun(renderers: RendererPool | Supervisor, samples: int = SAMPLES) -> tuple[int, Ears]:
    ears = Ears()
    task = renderers.open(ears, "render")
    await renderers.send_scene(Update(task, 1, arrays_of("plain"), settings(96, seed=4), StopRule(samples)))
    return task, ears


def renderer_specs(cluster: Cluster) -> list[RendererSpec]:
    return [
        RendererSpec(Place(str(number), "ray"), Options(), cluster.starter(number))
        for number in range(cluster.joined.renderers)
    ]


async def with_pool(cluster: Cluster, test: Callable[[RendererPool], Awaitable[None]]) -> None:
    pool = RendererPool(renderer_specs(cluster))
    pool.start()
    try:
        await pool.ready(30)
        await test(pool)
    finally:
        await pool.close()


async def until(condition: Callable[[], object], patience_s: float = 90.0) -> None:
    by = asyncio.get_running_loop().time() + patience_s
    while not condition():
        assert asyncio.get_running_loop().time() < by
        await asyncio.sleep(0.02)


def descendants(pid: int, word: str) -> list[int]:
    """The processes below `pid` that have that word in their command line."""
    found, parents = [], dict[int, int]()
    for process in (each for each in Path("/proc").iterdir() if each.name.isdigit()):
        with suppress(OSError):
            parents[int(process.name)] = int((process / "stat").read_text().rsplit(")", 1)[1].split()[1])
    for child in parents:
        if pid in ancestors(child, parents):
            with suppress(OSError):
                if word in Path(f"/proc/{child}/cmdline").read_text():
                    found.append(child)
    return found


def ancestors(pid: int, parents: dict[int, int]) -> Iterator[int]:
    while (pid := parents.get(pid, 0)) > 1:
        yield pid


def kill(pid: int) -> None:
    os.kill(pid, 9)


class Nodes:
    """A Ray cluster of several nodes on this machine, each started by `ray start` as on a host of its own."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._nodes: list[subprocess.Popen[bytes]] = []
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        self.address = f"127.0.0.1:{port}"
        head = self.add("--head", f"--port={port}", "--include-dashboard=false", cpus=0)
        by = time.monotonic() + 60
        while "Ray runtime started" not in self.log(head):
            assert time.monotonic() < by and head.poll() is None, self.log(head)
            time.sleep(0.1)

    def add(self, *more: str, cpus: int = 1) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "ray.scripts.scripts", "start", "--block", "--disable-usage-stats"]
        command += [f"--num-cpus={cpus}", "--num-gpus=0", f"--object-store-memory={100 << 20}"]
        command += more or [f"--address={self.address}"]
        with (self._folder / f"node{len(self._nodes)}.log").open("wb") as log:
            node = subprocess.Popen(command, env=os.environ | QUICK, stdout=log, stderr=log, process_group=0)
        self._nodes.append(node)
        return node

    def log(self, node: subprocess.Popen[bytes]) -> str:
        return (self._folder / f"node{self._nodes.index(node)}.log").read_text()

    def remove(self, node: subprocess.Popen[bytes]) -> None:
        """End a node as when its machine is switched off."""
        for pid in [*descendants(node.pid, ""), node.pid]:
            with suppress(ProcessLookupError):
                kill(pid)
        node.wait()

    def rendering(self) -> list[str]:
        """The ids of the nodes that have processors for renderers."""
        said = self._python("-c", LIST_NODES, self.address)
        return [line.split()[1] for line in said.splitlines() if line.startswith("node ")]

    def drain(self, id: str) -> None:
        """Have Ray take a node away in ten seconds."""
        command = ["-m", "ray.scripts.scripts", "drain-node", f"--address={self.address}", f"--node-id={id}"]
        command += ["--reason=DRAIN_NODE_REASON_PREEMPTION", "--reason-message=test"]
        self._python(*command, "--deadline-remaining-seconds=10")

    def _python(self, *command: str) -> str:
        return subprocess.run([sys.executable, *command], check=True, capture_output=True, text=True).stdout

    def close(self) -> None:
        for node in reversed(self._nodes):
            if node.poll() is None:
                self.remove(node)
