"""How much several renderers gain: measured with the cores of this machine, and simulated with more renderers than it
has.

On a software renderer two renderers of one core each are compared with one that has both, and with one that has one:
what several gain beyond one is what they do at the same time while each has few cores. A real server answers real
requests; its processes may use as many cores as its renderers have together.
"""

from __future__ import annotations

import json
import os
import statistics
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from gpu import Renderer
from service.bench import machine
from service.document import presets
from service.worker.division.ledger import MOST_BYTES
from tests.bench import scale_costs, scale_model
from tests.bench.server import Server

PLACES = (  # what runs, renderers, cores
    ("1 renderer of 1 core", 1, 1),
    ("1 renderer of 2 cores", 1, 2),
    ("2 renderers of 1 core", 2, 2),
)
SCENES = ("sphere-on-floor", "cornell-boxes", "roughness-row", "point-lights")
QUEUED = "cornell-boxes"
READY_S = 120.0
WORK = scale_model.Work(1920, 1080, 1024)
LINKS = {"1 Gbit/s": 1e9 / 8, "10 Gbit/s": 1e10 / 8, "100 Gbit/s": 1e11 / 8}
LATENCY_S = 0.0005  # one way, between hosts of one site
FASTER = (1, 100)  # times as fast as the renderer that is measured; GPUs trace 50 to 500 times as fast as a core


@dataclass(frozen=True)
class Options:
    """`quick`: figures that mean nothing, to try it out."""

    runs: int = 3
    quick: bool = False

    @property
    def queue(self) -> dict[str, Any]:
        small = {"width": 32, "height": 32, "max_samples": 8}
        return small if self.quick else {"width": 256, "height": 256, "max_samples": 64}

    @property
    def large(self) -> dict[str, Any]:
        small = {"width": 64, "height": 64, "max_samples": 72}
        return small if self.quick else {"width": 512, "height": 512, "max_samples": 128}

    @property
    def renders(self) -> int:
        return 2 if self.quick else 8


class NotMeasured(Exception):
    """Says why."""


def measure(options: Options, told: Callable[[str], None]) -> dict[str, Any]:
    """Everything, as JSON. Raises NotMeasured."""
    cores = sorted(os.sched_getaffinity(0))
    needed = max(count for _, _, count in PLACES)
    if len(cores) < needed:
        raise NotMeasured(f"{needed} cores are compared with one, and this process may use {len(cores)}")
    with Renderer() as renderer:
        about = machine.describe(renderer.info)
    load = os.getloadavg()[0]
    taken: dict[str, list[dict[str, float]]] = {name: [] for name, _, _ in PLACES}
    for run in range(options.runs):
        for name, renderers, count in PLACES:
            told(f"{name}, run {run + 1} of {options.runs}")
            taken[name].append(_serve(renderers, cores[:count], options))
    rows = [{"name": name, **_median(taken[name]), "runs": taken[name]} for name, _, _ in PLACES]
    return {
        "machine": about,
        "load": load,
        "queue": options.queue,
        "large": options.large,
        "quick": options.quick,
        "rows": rows,
    }


def _median(runs: list[dict[str, float]]) -> dict[str, float]:
    return {name: statistics.median(run[name] for run in runs) for name in runs[0]}


def _serve(renderers: int, cores: list[int], options: Options) -> dict[str, float]:
    """Renders per second of a queue, and seconds of one large render, of a server that may use these cores."""
    mine = os.sched_getaffinity(0)
    with tempfile.TemporaryDirectory() as folder:
        os.sched_setaffinity(0, cores)  # the server inherits it
        try:
            server = Server(Path(folder), {"SUNBOX_DEVICES": f"llvmpipe:{renderers}"})
        finally:
            os.sched_setaffinity(0, mine)
        try:
            _until_ready(server, renderers)
            for _ in range(renderers):
                _wait(server, _post(server, options.queue))  # compiles
            began = time.monotonic()
            for number in [_post(server, options.queue | {"seed": seed}) for seed in range(options.renders)]:
                _wait(server, number)
            queue_s = time.monotonic() - began
            began = time.monotonic()
            _wait(server, _post(server, options.large))
            large_s = time.monotonic() - began
        finally:
            server.stop()
    return {"renders_per_s": options.renders / queue_s, "large_s": large_s}


def _until_ready(server: Server, renderers: int) -> None:
    until = time.monotonic() + READY_S
    while time.monotonic() < until:
        status, body = server.ask("GET", "/v1/info")
        if status == 200 and sum(each["state"] == "ready" for each in json.loads(body)["renderers"]) == renderers:
            return
        time.sleep(0.2)
    raise NotMeasured(f"{renderers} renderers were not ready within {READY_S:g} s")


def _post(server: Server, settings: dict[str, Any]) -> str:
    order = {"scene": presets.get("scenes", QUEUED), "settings": settings}
    status, body = server.ask("POST", "/v1/renders", order)
    if status != 202:
        raise NotMeasured(f"a render was answered with {status}: {body.decode(errors='replace')[:200]}")
    number: str = json.loads(body)["id"]
    return number


def _wait(server: Server, number: str) -> None:
    while True:
        status, body = server.ask("GET", f"/v1/renders/{number}?wait=30")
        state = json.loads(body)["state"] if status == 200 else f"answered with {status}"
        if state == "done":
            return
        if state not in ("queued", "running"):
            raise NotMeasured(f"a render was {state}")


def simulate(most: int, quick: bool, told: Callable[[str], None]) -> dict[str, Any]:
    """Simulated speed-ups of 1, 2, 4 ... `most` renderers, with costs measured here, as JSON. `quick` as above."""
    size = 64 if quick else scale_costs.SIZE
    work = scale_model.Work(256, 128, 200) if quick else WORK
    costs = {}
    with Renderer() as renderer:
        about = machine.describe(renderer.info)
        for scene in SCENES[:1] if quick else SCENES:
            told(f"costs of {scene}")
            costs[scene] = scale_costs.measure(renderer, scene, size)
    door_s = scale_costs.forwarding_s()
    counts = [n for n in sorted({*(2**k for k in range(11)), most}) if n <= most]
    curves = []
    for scene, cost in costs.items():
        for faster in FASTER:
            for link, rate in LINKS.items():
                told(f"{scene}, {faster} times as fast, {link}")
                network = scale_model.Network(rate, LATENCY_S, door_s / MOST_BYTES)
                curves.append({"scene": scene, "faster": faster, "link": link,
                               **_curve(cost, faster, network, work, counts)})  # fmt: skip
    return {
        "machine": about,
        "quick": quick,
        "work": asdict(work),
        "latency_s": LATENCY_S,
        "forwarding_s": door_s,
        "costs": {scene: asdict(cost) for scene, cost in costs.items()},
        "renderers": counts,
        "curves": curves,
    }


def _curve(
    cost: scale_model.Costs,
    faster: int,
    network: scale_model.Network,
    work: scale_model.Work,
    counts: list[int],
) -> dict[str, Any]:
    """A renderer that is `faster` traces and merges in so much less time; to write a result takes as long as before,
    as that is a copy in memory."""
    quick = scale_model.Costs(cost.sample_s / faster, cost.write_s, cost.merge_s / faster, cost.meter_pixels)
    alone = scale_model.simulate(quick, network, work, 1).seconds
    outcomes = [scale_model.simulate(quick, network, work, n) for n in counts]
    return {
        "seconds": [each.seconds for each in outcomes],
        "speedup": [alone / each.seconds for each in outcomes],
        "busy": [each.busy for each in outcomes],
        "closed_form": [scale_model.speedup(quick, network, work, n) for n in counts],
        "limits": scale_model.limits(quick, network, work),
    }
