"""What is done for a GPU alone, tried on a processor that is told to be one: how work is cut, barriers, kept code."""

from __future__ import annotations

import ast
import ctypes
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from gpu import ContextError, DeviceLost, Picture, Renderer, RenderSettings, SceneTooLarge, egl
from gpu import context as contexts
from gpu.kernels import binaries
from gpu.kernels.binaries import Program, ProgramBinaries, binary_file
from gpu.precompile.kernel_keys import GUIDES, KernelKey, kernel_key
from gpu.precompile.precompiler import Precompiler
from service.document import parse_scene
from service.pack import pack
from tests.bench import standin
from tests.families import FamilyRenderer
from tests.rendering import Images, document, picture

GPU = Path(contexts.__file__).parent
FLOOR = {"type": "quad", "origin": [-3, -1, -3], "u": [0, 0, 6], "v": [6, 0, 0], "material": "m"}
BALL = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}
LAMP = {"type": "quad", "origin": [-1, 3, -1], "u": [2, 0, 0], "v": [0, 0, 2], "material": "lamp"}
LIT = document([FLOOR, BALL, LAMP], {"m": {"type": "diffuse", "albedo": 0.5},
                                     "lamp": {"type": "diffuse", "albedo": 0, "emission": 5}})  # fmt: skip
SETTINGS: dict[str, Any] = {"width": 80, "height": 60, "max_bounces": 3}


@pytest.fixture
def hardware(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The device calls itself one, with no kernels kept."""
    monkeypatch.setattr(contexts, "_SOFTWARE", ())
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path))


def saved(made: Picture) -> Any:
    steps = made.save()
    while True:
        try:
            next(steps)
        except StopIteration as ended:
            return ended.value


@pytest.mark.parametrize("more", [{}, {"adaptive": True}])
def test_the_same_bits_as_cut_for_a_processor(gpu: Renderer, more: dict[str, Any], hardware: None) -> None:
    """Large tiles, the meter's pixels beside the picture's, a block merged in the same wait."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(contexts, "_SOFTWARE", ("llvmpipe",))
        expected = picture(gpu, LIT, 140, **SETTINGS, **more)
        values, noise = expected.read(), expected.noise()
    made = picture(gpu, LIT, 140, **SETTINGS, **more)
    np.testing.assert_array_equal(made.read(), values)
    assert made.noise() == noise


def test_the_same_bits_from_wherever_it_was_saved(gpu: Renderer, hardware: None) -> None:
    made = picture(gpu, LIT, 140, **SETTINGS)
    expected = made.read()
    made.reset()
    stops = 0
    while made.samples < 140:
        made.trace(0.0, 140)  # one slice
        if made.samples + made.under_way[0] < 60:
            continue
        again = gpu.picture(made.scene, made.settings)
        again.restore(saved(made))
        while again.samples < 140:
            again.trace(1.0, 140)
        np.testing.assert_array_equal(again.read(), expected)
        again.release()
        stops += 1
    assert stops >= 3, "at least once a block"


@pytest.mark.parametrize(("size", "l_ms"), [((256, 256), 0.3), ((512, 512), 3.0), ((1920, 1080), 1.0)])
def test_a_stand_in_for_a_gpu_is_kept_busy(size: tuple[int, int], l_ms: float) -> None:
    """In simulated time: three quarters of the device, no wait above twice the slice, a meter that hardly costs."""
    row = standin.cell(size, l_ms)
    assert row["share"] >= 0.75 and row["longest_ms"] <= 30.0 and row["meter"] < 0.03


def test_kernels_are_started_in_one_place() -> None:
    """`contexts.dispatch`, which sees to what others read afterwards."""
    starts = [
        f"{path.relative_to(GPU)}:{node.lineno}"
        for path in GPU.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "run"
        if "kernel" in ast.unparse(node.func.value)
    ]
    assert len(starts) == 1 and starts[0].startswith("context.py"), starts


class Watched:
    """A context, buffer or kernel that fails where something is done to memory behind a kernel without a barrier."""

    fresh = False  # whether a kernel ran since the last barrier
    done: ClassVar[list[str]] = []

    def __init__(self, real: Any) -> None:
        self.__dict__["real"] = real

    def __getattr__(self, name: str) -> Any:
        value = getattr(self.real, name)
        if name == "memory_barrier":
            Watched.fresh = False
        if name in ("run", "read", "read_into", "write", "clear", "copy_buffer"):
            assert not Watched.fresh, f"{name} behind a kernel, without a barrier"
            Watched.done.append(name)
        if name == "run":
            Watched.fresh = True
        if name in ("buffer", "compute_shader"):
            return lambda *given, **named: Watched(value(*given, **named))
        return value

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(self.real, name, value)

    def __getitem__(self, name: str) -> Any:
        return self.real[name]

    def __enter__(self) -> Any:
        return self.real.__enter__()


@pytest.fixture
def watched(monkeypatch: pytest.MonkeyPatch) -> Iterator[Renderer]:
    create = contexts.create
    monkeypatch.setattr(contexts, "create", lambda device=None: Watched(create(device)))
    Watched.fresh, Watched.done = False, []
    with FamilyRenderer() as renderer:
        yield renderer


def test_nobody_reads_or_writes_behind_a_kernel_without_a_barrier(gpu: Renderer, watched: Renderer) -> None:
    """A renderer of its own, whose context watches: every way to trace, show, save and divide a picture."""
    made = picture(watched, LIT, 70, width=24, height=16)
    for aov in ("color", "albedo", "depth", "variance", "shape_coverage"):
        made.read(aov)
    made.noise()
    made.display()
    guess = watched.prior(made.read(), made.scene.arrays.camera, made.read("depth"))
    guess.correct(made.scene.arrays.camera, made.read()[::2, ::2], made.read()[::2, ::2], 4.0)
    made.display(prior=guess)
    again = watched.picture(made.scene, made.settings)
    again.restore(saved(made))
    again.trace(1.0, 80)
    adaptive = picture(watched, LIT, 70, width=24, height=16, adaptive=True)
    adaptive.read()
    assert {"run", "read", "write", "clear"} <= set(Watched.done)
    for each in (again, adaptive, made):
        each.release()


def test_a_kernel_is_kept_and_loaded_by_another_renderer(gpu: Renderer, hardware: None) -> None:
    """A renderer of its own each time: its kernels are in no cache of the session's."""
    arrays = pack(parse_scene(LIT), Images()).arrays
    settings = RenderSettings(16, 16, max_bounces=1)
    made = []
    for state in ("nothing is kept", "loaded", "cut short"):
        with FamilyRenderer() as renderer:
            one = renderer.picture(renderer.load(arrays), settings)
            one.trace(60.0, 4)
            made.append((one.read(), one.read("depth")))
            kernel = one._passes._kernel
            assert isinstance(kernel, Program) is (state == "loaded")
            one.release()
        files = list((binaries.cache_folder() / "programs").iterdir())
        assert len(files) == 2
        if state == "loaded":
            for file in files:
                file.write_bytes(file.read_bytes()[:-1])
    for color, depth in made[1:]:
        np.testing.assert_array_equal(color, made[0][0])
        np.testing.assert_array_equal(depth, made[0][1])


def test_a_compiler_keeps_what_a_renderer_loads(gpu: Renderer, hardware: None) -> None:
    """The compiler's own context compiles; its key says that the kernel is there, for this driver alone."""
    arrays = pack(parse_scene(LIT), Images()).arrays
    key = kernel_key(arrays, RenderSettings(8, 8), frozenset({"HAS_QUADS"}), GUIDES)
    info = contexts.describe(gpu.context)
    assert key.is_ours and not key.is_cached(info)
    assert Precompiler().compile(key)[1] and key.is_cached(info)
    assert Precompiler().compile(key)[0] < 50.0
    assert not key.is_cached(info | {"version": "another"})
    assert not KernelKey((), (), "merge.comp").is_ours
    contexts.use(gpu.context)
    assert ProgramBinaries(gpu.context).load(GUIDES, key.text) is not None


def test_a_processor_keeps_nothing(gpu: Renderer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path))
    kept = ProgramBinaries(gpu.context)
    assert not kept.able and not kept.has("text") and kept.load(GUIDES, "text") is None


def test_what_was_not_used_for_longest_goes(tmp_path: Path) -> None:
    info = {"renderer": "r", "version": "v"}
    assert binary_file(info, "a") != binary_file(info, "b")
    for age in range(10):
        file = tmp_path / str(age)
        file.write_bytes(bytes(100))
        os.utime(file, (1000 - age, 1000 - age))
    binaries._prune(tmp_path, 1000)
    assert len(list(tmp_path.iterdir())) == 10
    binaries._prune(tmp_path, 999)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["0", "1", "2", "3"]


@pytest.mark.parametrize("what", ["storage", "texture"])
def test_a_scene_beyond_what_the_driver_promises_is_refused(
    gpu: Renderer, what: str, hardware: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the figure, before anything is drawn from it; the renderer goes on."""
    values = {"GL_MAX_SHADER_STORAGE_BLOCK_SIZE": 100} if what == "storage" else {"GL_MAX_TEXTURE_SIZE": 8192}
    sky = Images(sky=np.ones((2, 8200, 3), np.float32))
    arrays = pack(parse_scene({**LIT, "environment": {"type": "image", "asset": "sky"}}), sky).arrays
    with monkeypatch.context() as patch:
        for name, value in values.items():
            patch.setitem(gpu.context.info, name, value)
        with pytest.raises(SceneTooLarge, match="MiB at once" if what == "storage" else "8200 x 2 texels"):
            gpu.load(arrays)
    gpu.load(arrays).release()


def test_a_driver_with_too_few_storage_buffers_is_named(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(contexts, "STORAGE_BLOCKS", 1 << 10)
    with pytest.raises(ContextError, match="storage buffers; Sunbox needs 1024"):
        contexts.create()


@pytest.fixture
def lost(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[int]]:
    """What the driver says of resets from now on."""
    said = [0]
    monkeypatch.setattr(egl, "_reset_status", lambda address: lambda: said[0])
    yield said


def test_after_a_reset_nothing_is_shown(gpu: Renderer, lost: list[int]) -> None:
    made = picture(gpu, LIT, 8, width=16, height=16)
    lost[0] = 0x8254
    assert gpu.reset_reason == "by another program"
    with pytest.raises(DeviceLost, match="by another program"):
        made.trace(1.0, 16)
    lost[0] = 0
    made.trace(1.0, 16)


def test_a_context_without_that_is_taken_as_well(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where EGL refuses, moderngl makes the context, and nobody hears of resets."""

    def refused(*given: Any) -> Any:
        raise egl.EglError("no such attribute")

    monkeypatch.setattr(egl, "EglContext", refused)
    with FamilyRenderer() as renderer:
        assert renderer.reset_reason is None
        assert picture(renderer, LIT, 1, width=8, height=8).samples == 1


def test_the_context_is_lost_where_its_device_is_reset(gpu: Renderer) -> None:
    """So that the driver says it: GL_RESET_NOTIFICATION_STRATEGY is GL_LOSE_CONTEXT_ON_RESET."""
    value = ctypes.c_int(0)
    ctypes.CDLL(contexts.opengl_library()).glGetIntegerv(0x8256, ctypes.byref(value))
    assert value.value == 0x8252 and gpu.reset_reason is None


class Card:
    """What EGL says of a device."""

    def __init__(self, extensions: str, said: dict[int, Any]) -> None:
        self._said = {egl.EXTENSIONS: extensions, **said}

    def string(self, device: Any, name: int) -> str:
        return str(self._said.get(name, ""))

    def number(self, device: Any, name: int) -> Any:
        return self._said.get(name)

    def binary(self, device: Any, name: int) -> bytes:
        return bytes(self._said.get(name, b""))


@pytest.mark.parametrize(
    ("extensions", "expected"),
    [
        ("", egl.Device("GPU", False)),
        ("EGL_MESA_device_software EGL_EXT_device_drm", egl.Device("software", True, pci="0000:0a:00.0")),
        ("EGL_EXT_device_drm", egl.Device("AMD, /dev/dri/card1", False, pci="0000:0a:00.0")),
        (
            "EGL_EXT_device_query_name EGL_EXT_device_drm",
            egl.Device("NVIDIA, H200, /dev/dri/card1", False, pci="0000:0a:00.0"),
        ),
        ("EGL_NV_device_cuda EGL_EXT_device_persistent_id", egl.Device("GPU", False, 3, "0a" * 16)),
    ],
)
def test_what_egl_and_linux_say_of_a_device(
    extensions: str, expected: egl.Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is asked that EGL does not know; the vendor is Linux' where EGL has none."""
    monkeypatch.setattr(egl, "DRM_CLASS", tmp_path)
    (tmp_path / "card1").mkdir()
    (tmp_path / "0000:0a:00.0").mkdir()
    (tmp_path / "0000:0a:00.0" / "vendor").write_text("0x1002\n")
    (tmp_path / "card1" / "device").symlink_to("../0000:0a:00.0")
    said = {egl.VENDOR: "NVIDIA", egl.RENDERER: "H200", egl.DRM_FILE: "/dev/dri/card1", egl.CUDA_DEVICE: 3,
            egl.UUID: b"\n" * 16}  # fmt: skip
    card: Any = Card(extensions, said)
    assert egl.described(card, None) == expected
