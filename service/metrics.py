"""/metrics: counters of the server, the renderer and the clients, as Prometheus' text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from importlib import metadata
from typing import TYPE_CHECKING, Any

from service.problems import Unavailable
from service.rendering.statistics import Distribution, Statistics

if TYPE_CHECKING:
    from prometheus_client.core import Metric
    from prometheus_client.registry import Collector

    from service.state import AppState
from service.traffic import Traffic

MIME = "text/plain; version=0.0.4; charset=utf-8"
PAGE = 4096  # bytes, of /proc/PID/statm


def text(state: AppState, traffic: Traffic) -> bytes:
    """One scrape."""
    from prometheus_client import CollectorRegistry, ProcessCollector, generate_latest

    registry = CollectorRegistry(auto_describe=False)
    ProcessCollector(registry=registry)
    registry.register(_collector(state, traffic))
    return generate_latest(registry)


def _collector(state: AppState, traffic: Traffic) -> Collector:
    from prometheus_client.registry import Collector

    class Sunbox(Collector):
        def collect(self) -> Iterator[Metric]:
            seen = state.renderers.statistics
            yield from _about(state.renderers.info or {})
            yield from _requests(traffic)
            yield from _work(seen)
            yield from _kernels(seen)
            yield from _failures(seen)
            yield from _clients(state)
            yield from _memory(state)
            yield from _disk(state)

    return Sunbox()


def _about(renderer: Mapping[str, Any]) -> Iterator[Metric]:
    from prometheus_client.core import GaugeMetricFamily

    about = GaugeMetricFamily("sunbox_info", "Version and renderer.", labels=("version", "renderer"))
    about.add_metric((metadata.version("sunbox"), str(renderer.get("renderer", ""))), 1)
    yield about
    yield _gauge("renderer_up", "Whether there is a renderer.", float(bool(renderer)))
    yield _gauge("renderer_software", "Whether it runs on the processor.", float(renderer.get("software", 0)))


def _requests(traffic: Traffic) -> Iterator[Metric]:
    labels = ("method", "route", "status")
    yield _counters("requests", "Requests, by method, route and status.", labels, traffic.count)
    yield _histogram("request_seconds", "From a request to its answer's end.", traffic.seconds)


def _work(seen: Statistics) -> Iterator[Metric]:
    yield _counter("frames", "Frames sent on streams.", seen.frames)
    yield _counter("frame_bytes", "Bytes of these frames.", seen.frame_bytes)
    yield _counter("samples", "Samples of pixels that were traced.", seen.samples)
    yield _histogram("first_frame_seconds", "From a stream's update to its first frame.", seen.first_frame_s)
    used = {(kind,): seconds for kind, seconds in seen.gpu_s.items()}
    yield _counters("gpu_seconds", "GPU time, by whose work it was.", ("client",), used)


def _kernels(seen: Statistics) -> Iterator[Metric]:
    yield _histogram("compile_seconds", "Compiling kernels that were not in memory.", seen.compile_s)
    yield _counter("kernel_cache_hits", "Loads whose kernel was in memory.", seen.kernels_found)
    yield _gauge("kernels", "Compiled kernels in the renderer's memory.", seen.kernels)
    evicted = "Kernels that made room for others or were long unused."
    yield _counter("kernels_evicted", evicted, seen.kernels_evicted)
    yield _histogram("setup_seconds", "Uploading a scene and compiling for it.", seen.setup_s)


def _failures(seen: Statistics) -> Iterator[Metric]:
    restarts = {(reason,): float(count) for reason, count in seen.restarts.items()}
    yield _counters("renderer_restarts", "Renderers lost, by how.", ("reason",), restarts)
    yield _counter("checkpoints", "Renders under way that were saved, to go on later.", seen.checkpoints)
    yield _histogram("recovery_seconds", "From a renderer's loss to the next one.", seen.recovery_s)
    errors = {(kind,): float(count) for kind, count in seen.errors.items()}
    yield _counters("errors", "Errors on streams and of failed renders, by problem.", ("type",), errors)


def _clients(state: AppState) -> Iterator[Metric]:
    renders = state.renders
    states = {"queued": renders.queued, "running": renders.running, "kept": renders.kept}
    yield _gauges("renders", "Renders requested over REST.", "state", states)
    if renders.store is not None:
        pictures, failures = renders.store.pictures.bytes, renders.store.failures
        yield _gauge("render_picture_bytes", "Checkpoints and pictures of renders on the disk.", pictures)
        yield _counter("render_write_failures", "Writes of renders to the disk that failed.", failures)
    sessions = {"connected": state.sessions.attended, "waiting": state.sessions.waiting}
    yield _gauges("streams", "Streams with a client, and those whose client may come back.", "state", sessions)


def _memory(state: AppState) -> Iterator[Metric]:
    seen = state.renderers.statistics
    yield _gauge("renderer_tasks", "Pictures that the renderer stores.", seen.tasks)
    yield _gauge("gpu_bytes", "GPU memory that they take.", seen.gpu_bytes)
    yield _gauges("memory_bytes", "Memory of SUNBOX_MEMORY, by what is in it.", "owner", state.memory.used())
    yield _gauge("memory_limit_bytes", "Most of it (SUNBOX_MEMORY).", state.memory.limit)
    yield _gauge("renderer_resident_bytes", "Memory of the renderer's process.", _resident(state))


def _disk(state: AppState) -> Iterator[Metric]:
    with suppress(Unavailable, OSError):  # the disk fails: all other metrics are still given
        stored = state.quota.used()
        yield _gauge("data_bytes", "Assets, documents and renders on the disk, in whole blocks.", stored.bytes)
        yield _gauge("data_files", "Files of assets, documents and renders.", stored.files)
    yield _gauge("data_quota_bytes", "What they may take.", state.config.data_quota)


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

    buckets = [(f"{bound:g}", float(count)) for bound, count in values.cumulative()]
    buckets.append(("+Inf", values.count))
    return HistogramMetricFamily(f"sunbox_{name}", help, buckets=buckets, sum_value=values.total)


def _resident(state: AppState) -> int:
    try:
        with open(f"/proc/{state.renderers.process_id}/statm") as sizes:
            return int(sizes.read().split()[1]) * PAGE
    except (OSError, ValueError, IndexError):
        return 0
