"""The renderers that the configuration asks for, and what each of them gets of the machine."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from typing import Any

from service.config import Config, cores
from service.renderers.local.process import ROOT, Options
from service.renderers.pool.pool import RendererSpec
from service.renderers.protocol import Place
from service.system.child_processes import inherited_environment

LISTING = "service.worker.list_devices"
LISTING_S = 60.0  # for a driver that wakes a GPU up, on a busy machine
GPUS_ONLY = "SUNBOX_DEVICES asks for renderers on the processor, and SUNBOX_REQUIRE_GPU forbids these; {there}"


def renderer_specs(config: Config, host_memory: int) -> list[RendererSpec]:
    """How and where each renderer runs. `host_memory`: bytes of the machine's memory that all together may hold."""
    options = Options(
        config.device,
        patience_s=config.hang_s,
        memory=config.gpu_memory,
        host_memory=host_memory // max(1, config.software_renderers, len(config.devices)),
        checkpoint_s=config.checkpoint_s,
        ahead=config.ahead,
        nice=config.nice,
    )
    if (count := config.software_renderers) > 0:
        memory = None if config.gpu_memory is None else config.gpu_memory // count
        options = replace(options, software=True, memory=memory)
        shares = [max(1, cores() // count + (i < cores() % count)) for i in range(count)]
        return [
            RendererSpec(Place(str(i), "llvmpipe"), replace(options, cores=share)) for i, share in enumerate(shares)
        ]
    if config.devices:
        return [
            RendererSpec(Place(str(i), device), replace(options, device=int(device)))
            for i, device in enumerate(config.devices)
        ]
    return [RendererSpec(Place("0", str(config.device or 0)), options)]


def missing_device(config: Config) -> str | None:
    """Why the renderers of SUNBOX_DEVICES cannot be here; None where they can, or it is not set.

    A process of its own asks EGL, whose libraries have no place in the server's.
    """
    if not config.devices:
        return None
    try:
        return _missing(config, listed())
    except NoDevices as error:
        return f"SUNBOX_DEVICES: {error}"


class NoDevices(Exception):
    """Why EGL's devices could not be listed, or why none of them is the one that was asked for."""


def listed() -> list[dict[str, Any]]:
    """EGL's devices, in a process of its own: `gpu.egl.Device` as dictionaries. Raises NoDevices."""
    command = [sys.executable, "-m", LISTING]
    try:
        done = subprocess.run(
            command,
            env=inherited_environment(),
            cwd=ROOT,
            capture_output=True,
            text=True,
            timeout=LISTING_S,
            check=True,
        )
        found = json.loads(done.stdout)
    except (OSError, subprocess.SubprocessError, ValueError) as error:
        raise NoDevices(f"EGL's devices could not be listed: {error}") from None
    if "error" in found:
        raise NoDevices(found["error"])
    devices: list[dict[str, Any]] = found["devices"]
    return devices


def of_cuda(id: str, devices: list[dict[str, Any]]) -> int:
    """The number of EGL's device that CUDA calls `id`: a number, or "GPU-" and a UUID. EGL has an order of its own,
    and takes no notice of CUDA_VISIBLE_DEVICES. Raises NoDevices."""
    there = ", ".join(f"{i} ({device['name']})" for i, device in enumerate(devices)) or "none at all"
    if id.startswith("MIG-"):
        raise NoDevices(f"{id}: a GPU that is divided by MIG has no OpenGL")
    wanted = id.removeprefix("GPU-").replace("-", "").lower()
    for number, device in enumerate(devices):
        if device["uuid"] == wanted if id.startswith("GPU-") else str(device["cuda"]) == id:
            return number
    if id.isdecimal() and all(device["cuda"] is None for device in devices) and int(id) < len(devices):
        return int(id)  # of another vendor, whose numbers Ray counts alike
    raise NoDevices(f"none of EGL's devices is the GPU {id} of CUDA; EGL has {there}")


def _missing(config: Config, devices: list[dict[str, object]]) -> str | None:
    """The same, with `devices`: `name` and `software` of each."""
    names = [f"{i} ({device['name']})" for i, device in enumerate(devices)]
    there = f"EGL has {', '.join(names)}" if names else "EGL has none at all"
    on_processor = [i for i, device in enumerate(devices) if device["software"]]
    if config.software_renderers:
        if not on_processor:
            return f"SUNBOX_DEVICES: Mesa's llvmpipe is not installed; {there}"
        return GPUS_ONLY.format(there=there) if config.require_gpu else None
    for number in map(int, config.devices):
        if number >= len(devices):
            return f"SUNBOX_DEVICES: there is no EGL device {number}; {there}"
        if config.require_gpu and number in on_processor:
            return GPUS_ONLY.format(there=there)
    return None
