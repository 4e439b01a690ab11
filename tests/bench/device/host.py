"""The machine, its driver, and what it promises."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Iterator

from gpu import context as contexts
from gpu.analysis.device_limits import device_limits
from service.bench import machine
from tests.bench.device.part import Options, Row

SM_COUNT, WARPS_PER_SM, WARP_SIZE = 0x933B, 0x933A, 0x9339  # NV_shader_thread_group
TOLD = ("KHR_shader_subgroup", "NV_", "robust", "parallel_shader_compile", "buffer_storage", "clear_buffer")


def rows(options: Options) -> Iterator[Row]:
    yield {"what": "EGL's devices", "devices": [str(device) for device in contexts.devices()]}
    smi = shutil.which("nvidia-smi")
    if smi:
        fields = "name,driver_version,memory.total,memory.used,clocks.sm,clocks.max.sm,mig.mode.current"
        asked = subprocess.run([smi, f"--query-gpu={fields}", "--format=csv"], capture_output=True, text=True)
        yield {"what": "nvidia-smi", "text": asked.stdout.strip()}
    limits = device_limits(options.device)
    yield {"what": "limits", "device": limits, "machine": machine.describe(limits)}
    context = contexts.create(options.device)
    get = ctypes.CDLL(contexts.opengl_library()).glGetIntegerv
    for name, number in (("multiprocessors", SM_COUNT), ("warps of each", WARPS_PER_SM), ("warp", WARP_SIZE)):
        value = (ctypes.c_int * 1)(0)
        if "GL_NV_shader_thread_group" in context.extensions:
            get(number, value)
        yield {"what": name, "value": value[0]}
    extensions = sorted(name for name in context.extensions if any(part in name for part in TOLD))
    yield {"what": "extensions", "of interest": extensions, "count": len(context.extensions)}
