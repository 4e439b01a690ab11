"""Compiled kernels are kept within a bound, those in use always; what had to go comes again, to the same bits."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from gpu import Renderer, RenderSettings
from gpu.kernels import cache
from gpu.kernels.cache import KernelCache
from service.worker.helpers import compile_client
from tests.supervisors import arrays_of

pytestmark = pytest.mark.exact

TEXT = """
layout(local_size_x = 8) in;
layout(std430, binding = 0) buffer B { uint b[]; };
void main() { b[0] = WHICH; }
"""


@pytest.fixture
def few(gpu: Renderer, tmp_path: Path) -> Iterator[KernelCache]:
    (tmp_path / "a.comp").write_text(TEXT)
    made = KernelCache(gpu.context, (tmp_path,), most=3, longest_s=100.0)
    yield made
    made.release()


def get(few: KernelCache, which: int) -> tuple[object, bool]:
    """The kernel, and whether it had to be compiled."""
    return few.get("a.comp", {"WHICH": which}), few.last_compile_ms > 0


def test_the_longest_unused_goes_first(few: KernelCache) -> None:
    for which in (1, 2, 3):
        assert get(few, which)[1]
    assert not get(few, 1)[1] and get(few, 4)[1]
    assert len(few) == 3 and few.evicted == 1
    assert not get(few, 1)[1] and not get(few, 3)[1] and get(few, 2)[1]


def test_what_is_held_stays(gpu: Renderer, few: KernelCache) -> None:
    held = [get(few, which)[0] for which in range(5) if few.hold(get(few, which)[0]) is None]
    for which in range(100, 120):
        get(few, which)
    assert len(few) == 5 + 3 and all(get(few, which) == (held[which], False) for which in range(5))
    output = gpu.context.buffer(reserve=4)
    output.bind_to_storage_buffer(0)
    held[3].run(1)  # type: ignore[attr-defined]
    assert np.frombuffer(output.read(), np.uint32)[0] == 3
    output.release()
    few.hold(held[0])
    for kernel in held:
        few.let_go(kernel)
    assert len(few) == 3 + 1 and get(few, 0) == (held[0], False)  # which somebody else still has


def test_age_ends_what_nobody_holds(few: KernelCache, monkeypatch: pytest.MonkeyPatch) -> None:
    now = 1000.0  # of the machine's own clock, tens of seconds may differ by a rounding
    monkeypatch.setattr(cache.time, "monotonic", lambda: now)
    assert few.tidy() is None
    few.hold(get(few, 1)[0])
    assert few.tidy() is None
    get(few, 2)
    now += 60
    get(few, 3)
    assert few.tidy() == pytest.approx(40) and len(few) == 3
    now += 40
    assert few.tidy() == pytest.approx(60) and len(few) == 2 and few.evicted == 1
    assert not get(few, 1)[1] and get(few, 2)[1]


def test_pictures_hold_theirs(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """One goes on to its bits while the bound is far exceeded, and gives its kernel back with itself."""
    monkeypatch.setattr(gpu._kernels, "_most", 1)
    held = sum(kept.holders for kept in gpu._kernels._cache.values())  # by pictures of other tests
    scene = gpu.load(arrays_of("plain"))
    picture = gpu.picture(scene, RenderSettings(32, 32))
    picture.trace(60.0, 3)
    for clamp, estimator in ((None, "bsdf"), (2.0, "mis"), (None, "light")):
        other = gpu.picture(scene, RenderSettings(32, 32, clamp=clamp, estimator=estimator))
        other.trace(60.0, 1)
        other.read("normal")
        other.display()
        other.release()
    assert len(gpu._kernels._free) <= 1
    picture.trace(60.0, 6)
    whole = gpu.picture(scene, RenderSettings(32, 32))
    whole.trace(60.0, 6)
    assert np.array_equal(picture.read(), whole.read())
    picture.configure(RenderSettings(32, 32, clamp=3.0))
    for made in (picture, whole):
        made.release()
    assert sum(kept.holders for kept in gpu._kernels._cache.values()) == held
    scene.release()


def test_records_of_kernels_are_pruned(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compile_client, "RECORDS", 10)
    for n in range(11):
        (tmp_path / str(n)).touch()
    compile_client._prune(tmp_path)
    assert len(list(tmp_path.iterdir())) == 5
    compile_client._prune(tmp_path)
    assert len(list(tmp_path.iterdir())) == 5
    compile_client._prune(tmp_path / "none")
