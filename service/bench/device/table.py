"""The figures of `sunbox bench gpu` for people."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from service.bench.device.stage import Row

MIB = 1 << 20


def table(report: dict[str, Any]) -> str:
    """A table for each part that has figures, then what could not be measured and why."""
    parts = (_scenes, _frames, _readouts, _blocks, _slices, _sides, _pairs, _trees, _kernels, _caustics)
    blocks = [_device(report), *("\n".join(part(report)) for part in parts)]
    missing = [f"  {row['what']}: {row['why']}" for row in report["missing"]]
    blocks.append("\n".join(["Not measured:", *missing]) if missing else "")
    blocks.append(f"This took {report['took_s']:.0f} s, of {report['seconds']:.0f} s that were given.")
    return "\n\n".join(filter(None, blocks))


def _columns(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """The first column to the left, the others to the right. Nothing where there are no rows."""
    lines = [tuple(head), *map(tuple, rows)]
    if len(lines) == 1:
        return []
    wide = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return [
        "  ".join(
            cell.ljust(w) if k == 0 else cell.rjust(w) for k, (cell, w) in enumerate(zip(line, wide, strict=True))
        )
        for line in lines
    ]


def _device(report: dict[str, Any]) -> str:
    device, lines = report["device"], [f"{key:10} {value}" for key, value in report["machine"].items()]
    if device is None:
        return "\n".join(lines)
    lines += [f"{key:10} {device[key]}" for key in ("vendor", "glsl")]
    known = {"memory": "MiB of memory", "free_memory": "MiB of it free"}
    lines += [f"{'':10} {device[key] // MIB} {what}" for key, what in known.items() if device[key] is not None]
    if device["subgroup_size"] is not None:
        lines.append(f"{'':10} {device['subgroup_size']} invocations in a subgroup")
    lines += [f"{'':10} {name} = {value}" for name, value in device["limits"].items()]
    if device["software"]:
        lines.append("The device is the processor: these figures say nothing of a GPU.")
    return "\n".join(lines)


def _size(row: Row) -> str:
    return f"{row['width']} x {row['height']}"


def _rate(rate: Row) -> tuple[str, str, str]:
    return f"{rate['mpaths_per_s']:.2f}", f"{rate['ms_per_sample']:.2f}", f"{100 * rate['spread']:.0f} %"


RATE = ("Mpaths/s", "ms/sample", "spread")


def _scenes(report: dict[str, Any]) -> list[str]:
    head = ("scene", "size", *RATE, "compile cold", "warm ms", "load ms", "device MiB", "expected")
    rows = [
        (
            row["scene"], _size(sized), *_rate(sized), f"{row['compile_cold_ms']:.0f}",
            f"{row['compile_warm_ms']:.0f}", f"{row['load_ms']:.0f}",
            "-" if sized["device_bytes"] is None else f"{sized['device_bytes'] / MIB:.0f}",
            f"{sized['picture_bytes'] / MIB:.0f}",
        )
        for row in report["scenes"]
        for sized in row["sizes"]
    ]  # fmt: skip
    return _columns(head, rows)


def _frames(report: dict[str, Any]) -> list[str]:
    kinds = ("scene_first", "scene_again", "material", "camera")
    names = (f"{kind.replace('_', ' ')} {p}" for kind in kinds for p in ("p50", "p95"))
    head = ("first frame, ms", "start cold", "start warm", *names)
    rows = [
        (
            _size(row), f"{row['start_cold_ms']:.0f}", f"{row['start_warm_ms']:.0f}",
            *(f"{row[kind][p]:.0f}" for kind in kinds for p in ("p50_ms", "p95_ms")),
        )
        for row in report["frames"]
    ]  # fmt: skip
    return _columns(head, rows)


def _readouts(report: dict[str, Any]) -> list[str]:
    head = ("reading, ms", "resolved", "linear", "format", "encoded", "KiB")
    rows = [
        (
            _size(row), f"{row['display_ms']:.2f}", f"{row['linear_ms']:.2f}", each["format"], f"{each['ms']:.2f}",
            f"{each['bytes'] / 1024:.0f}",
        )
        for row in report["readouts"]
        for each in row["encoded"]
    ]  # fmt: skip
    return _columns(head, rows)


def _blocks(report: dict[str, Any]) -> list[str]:
    names = ("merge", "read_band", "write_band")
    head = ("a block, ms", "merged", "read", "written", "MiB")
    rows = [
        (_size(row), *(f"{row[f'{name}_ms']:.2f}" for name in names), f"{row['band_bytes'] / MIB:.1f}")
        for row in report["blocks"]
    ]
    return _columns(head, rows)


def _slices(report: dict[str, Any]) -> list[str]:
    head = ("dispatches", "asked ms", "took ms", "paths", *RATE)
    rows = [
        (
            row["scene"],
            f"{row['slice_ms']:.0f}",
            f"{row['median_ms']:.2f}",
            f"{row['paths']:.0f}",
            *_rate(row["rate"]),
        )
        for row in report["slices"]
    ]
    return _columns(head, rows)


def _sides(report: dict[str, Any]) -> list[str]:
    head = ("whole pictures", "side", *RATE)
    return _columns(head, [(row["scene"], str(row["side"]), *_rate(row["rate"])) for row in report["sides"]])


def _pairs(report: dict[str, Any]) -> list[str]:
    head = ("processes", "Mpaths/s", "of each")
    rows = [
        (str(row["processes"]), f"{sum(each):.2f}", " + ".join(f"{rate:.2f}" for rate in each))
        for row in report["pairs"]
        for each in [row["mpaths_per_s"]]
    ]
    return _columns(head, rows)


def _trees(report: dict[str, Any]) -> list[str]:
    head = ("tree", "scene", "MiB", *RATE)
    rows = [
        (row["tree"], row["scene"], f"{row['node_bytes'] / MIB:.2f}", *_rate(row["rate"])) for row in report["trees"]
    ]
    return _columns(head, rows)


def _kernels(report: dict[str, Any]) -> list[str]:
    head = ("kernel with everything", "compiles in ms", "times as slow")
    rows = [(row["scene"], f"{row['full_compile_ms']:.0f}", f"{row['time_ratio']:.2f}") for row in report["kernels"]]
    return _columns(head, rows)


def _caustics(report: dict[str, Any]) -> list[str]:
    head = ("caustics, ms/sample", "from lights", "from the camera", "times as slow")
    rows = [
        (row["scene"], f"{light:.2f}", f"{paths:.2f}", f"{light / paths:.2f}")
        for row in report["caustics"]
        for light, paths in [(row["light"]["ms_per_sample"], row["paths"]["ms_per_sample"])]
    ]
    return _columns(head, rows)
