"""/metrics: counters of the server, the renderer and the clients, as Prometheus' text."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from importlib import metadata
from typing import TYPE_CHECKING, Any

from service.problems import Unavailable
from service.renderers.protocol import Member
from service.renderers.statistics import ClientStatistics, Distribution, Statistics
from service.system.background import deaths
from service.system.disk_usage import free
from service.system.executors import measuring

if TYPE_CHECKING:
    from prometheus_client.core import Metric

    from service.server.state import AppState
from service.server.http.request_log import Traffic

MIME = "text/plain; version=0.0.4; charset=utf-8"
PAGE = 4096  # bytes, of /proc/PID/statm


async def scrape(state: AppState, traffic: Traffic) -> bytes:
    """The metrics as text. The loop's own state is read on the event loop; a thread reads the disk and writes."""
    await measuring(_prepare)
    found = _of_the_loop(state, traffic)
    return await measuring(partial(_written, found, state))


def _prepare() -> None:
    """Import the library that writes metrics, which the start does without."""
    import prometheus_client.core  # noqa: F401


def _of_the_loop(state: AppState, traffic: Traffic) -> list[Metric]:
    members = state.renderers.members
    return [
        *_about(state.renderers.info or {}),
        *_states(members),
        *_requests(traffic),
        *_work(state.renderers.statistics, members),
        *_kernels(members),
        *_failures(state.renderers.statistics, members),
        *_clients(state),
        *_memory(state, members),
    ]


def _written(found: list[Metric], state: AppState) -> bytes:
    from prometheus_client import CollectorRegistry, ProcessCollector, generate_latest
    from prometheus_client.registry import Collector

    class Sunbox(Collector):
        def collect(self) -> Iterator[Metric]:
            yield from found
            yield from _disk(state)

    registry = CollectorRegistry(auto_describe=False)
    ProcessCollector(registry=registry)
    registry.register(Sunbox())
    return generate_latest(registry)


def _about(renderer: Mapping[str, Any]) -> Iterator[Metric]:
    from prometheus_client.core import GaugeMetricFamily

    about = GaugeMetricFamily("sunbox_info", "Version and renderer.", labels=("version", "renderer"))
    about.add_metric((metadata.version("sunbox-server"), str(renderer.get("renderer", ""))), 1)
    yield about
    yield _gauge("renderer_up", "Whether any renderer renders.", float(bool(renderer)))
    yield _gauge(
        "renderer_software", "Whether the first of them runs on the processor.", float(renderer.get("software", 0))
    )


def _states(members: Sequence[Member]) -> Iterator[Metric]:
    ready = {member.place.id: float(member.state == "ready") for member in members}
    yield _gauges("renderer_ready", "Whether this renderer renders.", "renderer", ready)


def _requests(traffic: Traffic) -> Iterator[Metric]:
    labels = ("method", "route", "status")
    yield _counters("requests", "Requests, by method, route and status.", labels, traffic.count)
    help = "Requests, by the first letters of the key's hash."
    yield _counters("key_requests", help, ("key",), _by_one(traffic.by_key))
    yield _histogram("request_seconds", "From a request to its answer's end.", traffic.seconds)


def _work(clients: ClientStatistics, members: Sequence[Member]) -> Iterator[Metric]:
    yield _counter("frames", "Frames sent on streams.", clients.frames)
    yield _counter("frame_bytes", "Bytes of these frames.", clients.frame_bytes)
    yield _histogram("first_frame_seconds", "From a stream's update to its first frame.", clients.first_frame_s)
    samples = _each(members, lambda seen: seen.samples)
    yield _counters("samples", "Samples of pixels that were traced.", ("renderer",), samples)
    used = _each_of(members, lambda seen: seen.gpu_s)
    yield _counters("gpu_seconds", "GPU time, by the kind of work.", ("renderer", "client"), used)
    by_key = _each_of(members, lambda seen: seen.gpu_s_by_key)
    help = "GPU time, by the first letters of the key's hash."
    yield _counters("key_gpu_seconds", help, ("renderer", "key"), by_key)


def _kernels(members: Sequence[Member]) -> Iterator[Metric]:
    compiled = {member.place.id: member.statistics.compile_s for member in members}
    yield _histograms("compile_seconds", "Compiling kernels that were not in memory.", "renderer", compiled)
    found = _each(members, lambda seen: seen.kernels_found)
    yield _counters("kernel_cache_hits", "Loads whose kernel was in memory.", ("renderer",), found)
    kernels = {id: float(count) for (id,), count in _each(members, lambda seen: seen.load.kernels).items()}
    yield _gauges("kernels", "Compiled kernels in a renderer's memory.", "renderer", kernels)
    evicted = _each(members, lambda seen: seen.kernels_evicted)
    yield _counters(
        "kernels_evicted", "Kernels that made room for others or were long unused.", ("renderer",), evicted
    )
    setup = {member.place.id: member.statistics.setup_s for member in members}
    yield _histograms("setup_seconds", "Uploading a scene and compiling for it.", "renderer", setup)


def _failures(clients: ClientStatistics, members: Sequence[Member]) -> Iterator[Metric]:
    restarts = _each_of(members, lambda seen: seen.restarts)
    yield _counters("renderer_restarts", "Renderers lost, by how.", ("renderer", "reason"), restarts)
    checkpoints = _each(members, lambda seen: seen.checkpoints)
    yield _counters("checkpoints", "Renders under way that were saved, to go on later.", ("renderer",), checkpoints)
    recovery = {member.place.id: member.statistics.recovery_s for member in members}
    yield _histograms("recovery_seconds", "From a renderer's loss to the next one.", "renderer", recovery)
    leases = _each_of(members, lambda seen: seen.leases)
    help = "Parts of divided pictures that a renderer was given by others, traced, failed to trace, or traced wrong."
    yield _counters("leases", help, ("renderer", "outcome"), leases)
    errors = _by_one(clients.errors)
    yield _counters("errors", "Errors on streams and of failed renders, by problem.", ("type",), errors)
    yield _counters("background_deaths", "Work that an error of the server ended.", ("what",), _by_one(deaths()))


def _clients(state: AppState) -> Iterator[Metric]:
    renders = state.render_queue
    states = {"queued": renders.queued, "running": renders.running, "kept": renders.retained}
    yield _gauges("renders", "Renders requested over REST.", "state", states)
    if renders.store is not None:
        pictures, failures = renders.store.pictures.bytes, renders.store.failures
        yield _gauge("render_picture_bytes", "Checkpoints and pictures of renders on the disk.", pictures)
        yield _counter("render_write_failures", "Writes of renders to the disk that failed.", failures)
    yield _counters(
        "callback_attempts", "Callbacks, by what became of them.", ("outcome",), _by_one(state.callbacks.outcomes)
    )
    yield _gauge("callbacks_pending", "Callbacks that wait for an end or an attempt.", state.callbacks.pending)
    sessions = {"connected": state.sessions.attended, "waiting": state.sessions.waiting}
    yield _gauges("streams", "Streams with a client, and those whose client may come back.", "state", sessions)


def _memory(state: AppState, members: Sequence[Member]) -> Iterator[Metric]:
    tasks = {member.place.id: float(member.statistics.load.tasks) for member in members}
    yield _gauges("renderer_tasks", "Pictures that a renderer stores.", "renderer", tasks)
    stored = {member.place.id: float(member.statistics.load.bytes) for member in members}
    yield _gauges("gpu_bytes", "GPU memory that they take.", "renderer", stored)
    yield _gauges("memory_bytes", "Memory of SUNBOX_MEMORY, by what is in it.", "owner", state.memory.used())
    loaded_pictures = state.render_queue.loaded_pictures.bytes
    yield _gauge("resting_bytes", "What ended renders take of it, until it is needed.", loaded_pictures)
    yield _gauge("memory_limit_bytes", "Most of it (SUNBOX_MEMORY).", state.memory.limit)
    here = socket.gethostname()
    resident = {each.place.id: float(_resident(each.process_id)) for each in members if each.place.host == here}
    yield _gauges("renderer_resident_bytes", "Memory of a renderer's process.", "renderer", resident)


def _disk(state: AppState) -> Iterator[Metric]:
    with suppress(Unavailable, OSError):  # where the disk fails, all other metrics are still sent
        stored = state.storage.quota.used()
        yield _gauge("data_bytes", "Assets, documents and renders on the disk, in whole blocks.", stored.bytes)
        yield _gauge("data_files", "Files of assets, documents and renders.", stored.files)
    yield _gauge("data_quota_bytes", "What they may take.", state.config.data_quota)
    yield _gauge("disk_free_bytes", "Bytes that are left on the data folder's disk.", free(state.config.data_dir))


# prometheus_client is imported where it is used, so that a server starts without it.


def _counter(name: str, help: str, value: float) -> Metric:
    from prometheus_client.core import CounterMetricFamily

    return CounterMetricFamily(f"sunbox_{name}", help, value=value)


def _counters(name: str, help: str, labels: tuple[str, ...], values: Mapping[Any, float]) -> Metric:
    from prometheus_client.core import CounterMetricFamily

    family = CounterMetricFamily(f"sunbox_{name}", help, labels=labels)
    for key, value in values.items():
        family.add_metric(key, value)
    return family


def _gauge(name: str, help: str, value: float) -> Metric:
    from prometheus_client.core import GaugeMetricFamily

    return GaugeMetricFamily(f"sunbox_{name}", help, value=value)


def _gauges(name: str, help: str, label: str, values: Mapping[str, float]) -> Metric:
    from prometheus_client.core import GaugeMetricFamily

    family = GaugeMetricFamily(f"sunbox_{name}", help, labels=(label,))
    for key, value in values.items():
        family.add_metric((key,), value)
    return family


def _histogram(name: str, help: str, values: Distribution) -> Metric:
    from prometheus_client.core import HistogramMetricFamily

    return HistogramMetricFamily(f"sunbox_{name}", help, buckets=_buckets(values), sum_value=values.total)


def _histograms(name: str, help: str, label: str, values: Mapping[str, Distribution]) -> Metric:
    from prometheus_client.core import HistogramMetricFamily

    family = HistogramMetricFamily(f"sunbox_{name}", help, labels=(label,))
    for key, value in values.items():
        family.add_metric((key,), _buckets(value), value.total)
    return family


def _buckets(values: Distribution) -> list[tuple[str, float]]:
    buckets = [(f"{bound:g}", float(count)) for bound, count in values.cumulative()]
    return [*buckets, ("+Inf", values.count)]


def _by_one(counts: Mapping[str, int]) -> dict[tuple[str], float]:
    """By the values of one label."""
    return {(label,): float(count) for label, count in counts.items()}


def _each(members: Sequence[Member], value: Callable[[Statistics], float]) -> dict[tuple[str], float]:
    """By renderer."""
    return {(member.place.id,): float(value(member.statistics)) for member in members}


def _each_of(
    members: Sequence[Member], values: Callable[[Statistics], Mapping[Any, float]]
) -> dict[tuple[str, str], float]:
    """By renderer, and by the labels of the renderer's own counts."""
    return {
        (member.place.id, key): float(value) for member in members for key, value in values(member.statistics).items()
    }


def _resident(process_id: int | None) -> int:
    try:
        with open(f"/proc/{process_id}/statm") as sizes:
            return int(sizes.read().split()[1]) * PAGE
    except (OSError, ValueError, IndexError):
        return 0
