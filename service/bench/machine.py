"""The machine that was measured: without it a figure means nothing."""

from __future__ import annotations

import os
import platform
import subprocess
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]


def describe(renderer: dict[str, Any]) -> dict[str, Any]:
    """Processor, cores, driver and commit; `renderer` is Renderer.info."""
    return {
        "processor": processor(),
        "cores": cores(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "renderer": renderer["renderer"],
        "driver": renderer["version"],
        "commit": commit(),
    }


def shader_caches(folder: str | Path) -> dict[str, str]:
    """Variables of the environment with which Mesa's and NVIDIA's drivers cache kernels in that folder."""
    return {"MESA_SHADER_CACHE_DIR": str(folder), "__GL_SHADER_DISK_CACHE_PATH": str(folder)}


def cores() -> int:
    return len(os.sched_getaffinity(0))


def commit() -> str | None:
    """The checkout's commit, "+" after it when files differ; None outside a checkout."""
    head = _git("rev-parse", "HEAD")
    return head and head + ("+" if _git("status", "--porcelain") else "")


def _git(*arguments: str) -> str | None:
    try:
        answer = subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True, text=True, timeout=20)
    except OSError:
        return None
    return answer.stdout.strip() if answer.returncode == 0 else None


def processor() -> str:
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()
