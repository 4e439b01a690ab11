"""/metrics: counters of the server, the renderer and the clients, as Prometheus' text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from importlib import metadata
from typing import TYPE_CHECKING, Any

from service.problems import Unavailable
from service.rendering.statistics import Distribution

if TYPE_CHECKING:
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
    from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily, Metric
    from prometheus_client.registry import Collector

    def counter(name: str, help: str, value: float) -> Metric:
        return CounterMetricFamily(f"sunbox_{name}", help, value=value)

    def counters(name: str, help: str, labels: tuple[str, ...], values: Mapping[Any, float]) -> Metric:
        family = CounterMetricFamily(f"sunbox_{name}", help, labels=labels)
        for key, value in values.items():
            family.add_metric(key, value)
        return family

    def gauge(name: str, help: str, value: float) -> Metric:
        return GaugeMetricFamily(f"sunbox_{name}", help, value=value)

    def gauges(name: str, help: str, label: str, values: Mapping[str, float]) -> Metric:
        family = GaugeMetricFamily(f"sunbox_{name}", help, labels=(label,))
        for key, value in values.items():
            family.add_metric((key,), value)
        return family

    def histogram(name: str, help: str, values: Distribution) -> Metric:
        buckets = [(f"{bound:g}", float(count)) for bound, count in values.cumulative()]
        return HistogramMetricFamily(
            f"sunbox_{name}", help, buckets=[*buckets, ("+Inf", values.count)], sum_value=values.total
        )

    class Sunbox(Collector):
        def collect(self) -> Iterator[Metric]:
            seen = state.renderers.statistics
            renderer = state.renderers.info or {}
            about = GaugeMetricFamily("sunbox_info", "Version and renderer.", labels=("version", "renderer"))
            about.add_metric((metadata.version("sunbox"), str(renderer.get("renderer", ""))), 1)
            yield about
            yield gauge("renderer_up", "Whether there is a renderer.", float(bool(renderer)))
            yield gauge("renderer_software", "Whether it runs on the processor.", float(renderer.get("software", 0)))
            requests = "Requests, by method, route and status."
            yield counters("requests", requests, ("method", "route", "status"), traffic.count)
            yield histogram("request_seconds", "From a request to its answer's end.", traffic.seconds)
            yield counter("frames", "Frames sent on streams.", seen.frames)
            yield counter("frame_bytes", "Bytes of these frames.", seen.frame_bytes)
            yield counter("samples", "Samples of pixels that were traced.", seen.samples)
            yield histogram("first_frame_seconds", "From a stream's update to its first frame.", seen.first_frame_s)
            used = {(kind,): seconds for kind, seconds in seen.gpu_s.items()}
            yield counters("gpu_seconds", "GPU time, by whose work it was.", ("client",), used)
            yield histogram("compile_seconds", "Compiling kernels that were not in memory.", seen.compile_s)
            yield counter("kernel_cache_hits", "Loads whose kernel was in memory.", seen.kernels_found)
            yield gauge("kernels", "Compiled kernels in the renderer's memory.", seen.kernels)
            let_go = "Kernels that made room for others or were long unused."
            yield counter("kernels_evicted", let_go, seen.kernels_evicted)
            yield histogram("setup_seconds", "Uploading a scene and compiling for it.", seen.setup_s)
            restarts = {(reason,): float(count) for reason, count in seen.restarts.items()}
            yield counters("renderer_restarts", "Renderers lost, by how.", ("reason",), restarts)
            yield counter("checkpoints", "Renders under way that were saved against such a loss.", seen.checkpoints)
            yield histogram("recovery_seconds", "From a renderer's loss to the next one.", seen.recovery_s)
            errors = {(kind,): float(count) for kind, count in seen.errors.items()}
            yield counters("errors", "Told on streams and of failed renders, by problem.", ("type",), errors)
            renders = state.renders
            states = {"queued": renders.queued, "running": renders.running, "kept": renders.kept}
            yield gauges("renders", "Renders asked for over REST.", "state", states)
            sessions = {"connected": state.sessions.attended, "waiting": state.sessions.waiting}
            yield gauges("streams", "Streams with a client, and those whose client may come back.", "state", sessions)
            yield gauge("renderer_tasks", "Pictures that the renderer holds.", seen.tasks)
            yield gauge("gpu_bytes", "What they hold on the GPU.", seen.gpu_bytes)
            yield gauge("renderer_resident_bytes", "Memory of the renderer's process.", _resident(state))
            with suppress(Unavailable, OSError):  # the disk fails: all other metrics are still given
                stored = state.quota.used()
                yield gauge("data_bytes", "Assets and documents on the disk, in whole blocks.", stored.bytes)
                yield gauge("data_files", "Files of assets and documents.", stored.files)
            yield gauge("data_quota_bytes", "What they may take.", state.config.data_quota)

    return Sunbox()


def _resident(state: AppState) -> int:
    try:
        with open(f"/proc/{state.renderers.process_id}/statm") as sizes:
            return int(sizes.read().split()[1]) * PAGE
    except (OSError, ValueError, IndexError):
        return 0
