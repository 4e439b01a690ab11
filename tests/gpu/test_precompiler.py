"""What a process that compiles ahead finds out about the driver's disk cache, from the time that kernels take."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any

import pytest

from gpu import KernelKey
from gpu.precompile.kernel_keys import common_keys
from gpu.precompile.precompiler import Precompiler


class Timed(Precompiler):
    """Takes these seconds for the kernel that is asked for, and for any other."""

    _binaries: Any

    def __init__(self, asked_s: list[float], other_s: list[float]) -> None:
        self._has_cache, self._binaries = None, SimpleNamespace(able=False)
        self._seconds = {True: iter(asked_s), False: iter(other_s)}
        self._last = {True: asked_s[-1], False: other_s[-1]}

    def _once(self, wanted: KernelKey) -> float:
        asked = wanted == common_keys()[0]
        return next(self._seconds[asked], self._last[asked])


@pytest.mark.parametrize(
    ("asked_s", "other_s", "cached"),
    [
        ([0.01], [], True),
        ([2.0, 2.0, 0.1], [], True),  # the driver writes it a little later
        ([0.5, 0.5], [0.1, 0.005], True),  # it was there before, and takes so long to load
        ([0.5, 0.5], [0.1, 0.1], False),
        ([60.0, 60.0], [0.1, 0.005], False),  # perhaps it is too large
    ],
)
def test_whether_the_disk_cache_has_a_kernel(
    asked_s: list[float], other_s: list[float], cached: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(time, "sleep", lambda seconds: None)
    assert Timed(asked_s, other_s or [0.0]).compile(common_keys()[0])[1] == cached
