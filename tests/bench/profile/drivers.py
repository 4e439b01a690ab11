"""Another Mesa beside the system's, in turns: its packages unpacked into a folder, with `dpkg -x` or alike."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from service.bench import machine
from service.bench.scenes import cases
from tests.bench.compare import Side

SIZE, SAMPLES = 256, 4

_DESCRIBE = """
import json
from gpu import Renderer
from tests.bench.profile.load_costs import load_costs
with Renderer() as renderer:
    info = renderer.info
print(json.dumps({"renderer": f"{info['renderer']}, {info['version']}", "loads": load_costs()}))
"""


class NoMesa(Exception):
    """The folder holds no Mesa."""


def variables(root: Path, folder: Path) -> dict[str, str]:
    """Environment variables with which a process finds the Mesa in `root`; its description for EGL and its cache of
    kernels are in `folder`. Raises NoMesa."""
    egl = next(root.resolve().rglob("libEGL_mesa.so.0"), None)
    drivers = next(root.resolve().rglob("swrast_dri.so"), None)
    if egl is None or drivers is None:
        raise NoMesa(f"{root}: holds no libEGL_mesa.so.0 with swrast_dri.so")
    vendor = folder / "vendor.json"
    vendor.write_text(json.dumps({"file_format_version": "1.0.0", "ICD": {"library_path": str(egl)}}))
    return {
        "LD_LIBRARY_PATH": str(egl.parent),
        "LIBGL_DRIVERS_PATH": str(drivers.parent),
        "__EGL_VENDOR_LIBRARY_FILENAMES": str(vendor),
        **machine.shader_caches(folder / "cache"),
    }


def measure(root: Path, runs: int, told: Callable[[str], None], size: int = SIZE) -> list[dict[str, Any]]:
    """A row for each scene of the speed bench: nanoseconds of one core for a path with the system's Mesa, and how
    many times as fast that is as the other. Raises NoMesa; EOFError where one of the two cannot render."""
    rows = []
    with tempfile.TemporaryDirectory(prefix="sunbox-profile-") as name:
        folder = Path(name)
        (folder / "cache").mkdir()
        listed = [{"scene": case.scene, "max_bounces": case.max_bounces} for case in cases()]
        (folder / "cases.json").write_text(json.dumps(listed))
        other = variables(root, folder)
        for number, case in enumerate(cases()):
            told(f"two drivers: {case.name}, {case.max_bounces} bounces")
            sides = [Side(machine.ROOT, folder), Side(machine.ROOT, folder, other)]
            try:
                times = [[side.time(number, size, SAMPLES)["cpu_s"] for side in sides] for _ in range(runs)]
            finally:
                for side in sides:
                    side.close()
            scale = 1e9 / (size * size * SAMPLES)
            ours, theirs = (scale * statistics.median(column) for column in zip(*times, strict=True))
            row = {"name": case.name, "max_bounces": case.max_bounces, "path_ns": ours, "other_path_ns": theirs}
            rows.append(row | {"ratio": statistics.median(b / a for a, b in times)})
    return rows


def described(root: Path) -> dict[str, Any]:
    """`renderer`, what the other Mesa says of itself, and `loads`, its load_costs. Raises NoMesa."""
    with tempfile.TemporaryDirectory(prefix="sunbox-profile-") as name:
        (Path(name) / "cache").mkdir()
        environment = os.environ | variables(root, Path(name)) | {"PYTHONPATH": str(machine.ROOT)}
        done = subprocess.run(
            [sys.executable, "-P", "-c", _DESCRIBE], env=environment, capture_output=True, text=True
        )
        if done.returncode:
            raise NoMesa(f"{root}: {done.stderr.strip().splitlines()[-1]}")
        answer: dict[str, Any] = json.loads(done.stdout)
        return answer
