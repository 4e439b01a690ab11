"""Prints EGL's devices as JSON, or why there are none: `python -m service.worker.list_devices`."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict

from gpu import GpuError, devices


def main() -> int:
    try:
        found: dict[str, object] = {"devices": [asdict(device) for device in devices()]}
    except GpuError as error:
        found = {"error": str(error)}
    json.dump(found, sys.stdout)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
