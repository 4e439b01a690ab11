"""Prints EGL's devices as JSON, or why there are none: `python -m service.worker.list_devices`."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict

from gpu import ContextError, GpuError, Renderer, devices


def main() -> int:
    try:
        found: dict[str, object] = {"devices": [asdict(device) for device in devices()]}
    except GpuError as error:
        found = {"error": str(error)}
    json.dump(found, sys.stdout)
    return 0


def names() -> list[str]:
    """For each of EGL's devices its vendor and its renderer, as OpenGL says them, and its place on the PCI bus. Makes
    a context on each, which wakes GPUs up. Raises ContextError where EGL lists none."""
    named = []
    for number, device in enumerate(devices()):
        try:
            renderer = Renderer(number)
        except ContextError:
            named.append(f"{device.name}, which cannot render")
            continue
        info = renderer.info
        renderer.close()
        named.append(", ".join(filter(None, (info["vendor"], info["renderer"], device.pci))))
    return named


if __name__ == "__main__":
    raise SystemExit(main())
