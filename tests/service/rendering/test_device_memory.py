"""How much of a device's memory a renderer takes, by what its driver says."""

from __future__ import annotations

from typing import Any

import pytest

from gpu import context
from gpu.analysis.device_limits import free_memory
from service.config import MIB
from service.system.memory import MemoryBudget
from service.worker.device.memory import UNLIMITED, default_limit


def test_the_device_has_a_share() -> None:
    assert default_limit({"software": True, "memory": None}, None, 1000) == 1000
    assert default_limit({"software": True, "memory": None}, None, None) == MemoryBudget().limit
    assert default_limit({"software": False, "memory": 1000}, 600, 5) == 480, "others have the rest"
    assert default_limit({"software": False, "memory": None}, 600, 5) == 480
    assert default_limit({"software": False, "memory": 1000}, None, 5) == 800
    assert default_limit({"software": False, "memory": None}, None, 5) == UNLIMITED


def test_a_gpu_s_memory_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    class Context:
        info = dict.fromkeys(("GL_RENDERER", "GL_VERSION", "GL_VENDOR"), "a GPU")
        extensions = frozenset({"GL_NVX_gpu_memory_info"})

    class Library:
        def __init__(self, name: str) -> None:
            pass

        def glGetIntegerv(self, name: int, value: Any) -> None:
            assert name == context.DEDICATED_VIDEO_MEMORY
            value._obj.value = kibibytes

    kibibytes = 4096
    monkeypatch.setattr("ctypes.CDLL", Library)
    assert context.describe(Context())["memory"] == 4 * MIB
    kibibytes = -8
    assert context.describe(Context())["memory"] is None
    kibibytes = 4096
    monkeypatch.setitem(Context.info, "GL_RENDERER", "llvmpipe (LLVM 15.0.6, 256 bits)")
    assert context.describe(Context())["memory"] is None, "it lists the extension, and answers with anything"
    monkeypatch.setattr(Context, "extensions", frozenset())
    assert context.describe(Context())["memory"] is None


@pytest.mark.parametrize(
    ("extensions", "said", "expected"),
    [
        ({"GL_NVX_gpu_memory_info", "GL_ATI_meminfo"}, {0x9049: 3072, 0x87FB: 1}, 3 * MIB),
        ({"GL_ATI_meminfo"}, {0x87FB: 2048}, 2 * MIB),  # AMD's own driver
        ({"GL_NVX_gpu_memory_info"}, {0x9049: -8}, None),
        (set(), {}, None),
    ],
)
def test_a_gpu_s_free_memory_is_asked_for(
    extensions: set[str], said: dict[int, int], expected: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Context:
        info = dict.fromkeys(("GL_RENDERER", "GL_VERSION", "GL_VENDOR"), "a GPU")

    class Library:
        def __init__(self, name: str) -> None:
            pass

        def glGetIntegerv(self, name: int, values: Any) -> None:
            if name != context.DEDICATED_VIDEO_MEMORY:
                values[0] = said[name]

    card: Any = Context()
    card.extensions = extensions
    monkeypatch.setattr("ctypes.CDLL", Library)
    assert free_memory(card) == expected
    monkeypatch.setitem(Context.info, "GL_RENDERER", "llvmpipe (LLVM 15.0.6, 256 bits)")
    assert free_memory(card) is None
