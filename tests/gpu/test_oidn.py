"""Open Image Denoise on a GPU, which the processor plays: what pyoidn calls is a library that has one besides."""

from __future__ import annotations

import logging
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gpu import denoise, egl
from gpu.oidn import GpuFilter
from service.worker.helpers import denoise_main
from service.worker.helpers.denoise_client import DenoiseClient, DenoiseRequest, Located

pyoidn = pytest.importorskip("pyoidn")

CARD = egl.Device("a card", False, uuid="0a" * 16)
BUS = {b"pciDomain": 0, b"pciBus": 0x0A, b"pciDevice": 3, b"pciFunction": 1}
NO_MEMORY = b"out of memory"


class Library:
    """The library, which has a GPU besides the processor. Work for the GPU is the processor's."""

    def __init__(self, real: Any, ffi: Any) -> None:
        self._real, self._ffi = real, ffi
        self.kind = 3  # CUDA
        self.uuid = bytes.fromhex(CARD.uuid)
        self.fails = ""  # the function that does
        self.released = 0
        self._error: Any = None
        self._on_gpu = set[Any]()  # devices, filters and buffers

    def __getattr__(self, name: str) -> Any:
        real = getattr(self._real, name)

        def call(*given: Any) -> Any:
            if not given or given[0] not in self._on_gpu:
                return real(*given)
            assert name != "oidnSetSharedFilterImage", "a GPU does not read the machine's memory"
            if name == self.fails:
                return self._fail()
            self.released += name == "oidnReleaseDevice"
            made = real(*given)
            if name.startswith("oidnNew"):
                self._on_gpu.add(made)
            return made

        return call

    def _fail(self) -> Any:
        self._error = self._ffi.new("char[]", NO_MEMORY)
        return self._ffi.NULL

    def oidnGetNumPhysicalDevices(self) -> int:
        return 2

    def oidnGetPhysicalDeviceInt(self, number: int, name: bytes) -> int:
        return {b"type": self.kind, **BUS}[name] if number else 1

    def oidnGetPhysicalDeviceBool(self, number: int, name: bytes) -> bool:
        return bool(self.uuid) if name == b"uuidSupported" else not self.uuid

    def oidnGetPhysicalDeviceString(self, number: int, name: bytes) -> Any:
        self._name = self._ffi.new("char[]", b"NVIDIA H200")
        return self._name

    def oidnGetPhysicalDeviceData(self, number: int, name: bytes, size: Any) -> Any:
        self._id = self._ffi.new("char[]", self.uuid)
        size[0] = 16
        return self._id

    def oidnNewDeviceByID(self, number: int) -> Any:
        assert number == 1
        if self.fails == "oidnNewDeviceByID":
            return self._fail()
        self._on_gpu.add(device := self._real.oidnNewDevice(1))
        return device

    def oidnGetDeviceError(self, device: Any, message: Any) -> int:
        if self._error is None:
            return int(self._real.oidnGetDeviceError(device, message))
        self._last, self._error = self._error, None
        message[0] = self._last
        return 4


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch) -> Library:
    from pyoidn import capi

    capi.oidn_Capi.oidnIsCPUDeviceSupported()  # loads it
    stand_in = Library(capi.oidn_Capi._entrypoint, capi.oidn_ffi)
    monkeypatch.setattr(capi.oidn_Capi, "_entrypoint", stand_in)
    return stand_in


def pictures(width: int, guided: bool) -> tuple[np.ndarray, Any, Any]:
    rng = np.random.default_rng(width)
    color = rng.gamma(4, 0.25, (40, width, 4)).astype(np.float32)
    color[..., 3] = 1
    guides = rng.random((2, 40, width, 3), np.float32) if guided else (None, None)
    return color, guides[0], guides[1]


@pytest.mark.parametrize("fine", [True, False])
def test_the_way_through_its_memory_changes_no_bit(
    library: Library, monkeypatch: pytest.MonkeyPatch, fine: bool
) -> None:
    """Pictures of several sizes in turn, with guides and without."""
    cases = [pictures(width, guided) for width, guided in ((48, True), (64, False), (32, True), (32, False))]
    by = GpuFilter(CARD)
    assert by.name == "CUDA (NVIDIA H200)"
    found = [denoise.denoise(*case, fine, by) for case in cases]
    by.close()
    monkeypatch.undo()
    for case, smooth in zip(cases, found, strict=True):
        np.testing.assert_array_equal(smooth, denoise.denoise(*case, fine))
        assert not np.array_equal(smooth, case[0])


@pytest.mark.parametrize(
    ("kind", "device", "name"),
    [
        (4, egl.Device("", False, uuid="0b" * 16, pci="0000:0a:03.1"), "HIP (NVIDIA H200)"),
        (2, egl.Device("", False, pci="0000:0a:03.1"), "SYCL (NVIDIA H200)"),
        (4, egl.Device("another", False, pci="0000:0b:03.1"), None),
        (5, egl.Device("Apple's", False, pci="0000:0a:03.1"), None),
        (4, egl.Device("unknown", False), None),
    ],
)
def test_other_cards_are_told_by_their_place(library: Library, kind: int, device: egl.Device, name: str) -> None:
    library.kind, library.uuid = kind, b""
    if name is None:
        with pytest.raises(RuntimeError, match=f"does not find {device.name}"):
            GpuFilter(device)
        return
    by = GpuFilter(device)
    assert by.name == name
    by.close()


def test_a_neighbour_is_left_alone(library: Library) -> None:
    with pytest.raises(RuntimeError, match="does not find"):
        GpuFilter(egl.Device("the second", False, uuid="0b" * 16))


@pytest.fixture
def steps(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Of niceness that were taken."""
    taken: list[int] = []
    monkeypatch.setattr(os, "nice", taken.append)
    monkeypatch.setattr(denoise_main, "devices", lambda: [CARD])
    return taken


def order(width: int = 48) -> DenoiseRequest:
    return DenoiseRequest(*pictures(width, True), True)


def test_the_gpu_denoises_beside_a_gpu(library: Library, steps: list[int]) -> None:
    said: list[Located] = []
    denoiser = denoise_main.Denoiser(0, said.append)
    assert denoiser.deliver(order()).pixels is not None
    assert said == [Located("CUDA (NVIDIA H200)")] and steps == [] and library.released == 0


@pytest.mark.parametrize(
    "fails", ["oidnNewDeviceByID", "oidnCommitDevice", "oidnNewFilter", "oidnNewBufferWithStorage"]
)
def test_the_processor_denoises_where_the_gpu_cannot_begin(library: Library, steps: list[int], fails: str) -> None:
    library.fails = fails
    said: list[Located] = []
    denoiser = denoise_main.Denoiser(0, said.append)
    assert [located.place for located in said] == [denoise.PROCESSOR] and "out of memory" in said[0].detail
    assert library.released == (fails != "oidnNewDeviceByID"), "its memory is given back"
    assert steps == [denoise_main.NICENESS]
    assert denoiser.deliver(order()).pixels is not None and len(said) == 1


@pytest.mark.parametrize("fails", ["oidnCommitFilter", "oidnExecuteFilter", "oidnReadBuffer"])
def test_a_picture_that_the_gpu_cannot_denoise_is_the_processor_s(
    library: Library, steps: list[int], fails: str
) -> None:
    """And so are those that follow; the same bits as if there had been no GPU."""
    said: list[Located] = []
    denoiser = denoise_main.Denoiser(0, said.append)
    library.fails = fails
    expected = denoise_main.Denoiser(None, said.append).deliver(order()).pixels
    steps.clear()
    for _ in range(2):
        answer = denoiser.deliver(order())
        assert answer.pixels is not None and expected is not None and not answer.detail
        np.testing.assert_array_equal(answer.pixels, expected)
    assert [located.place for located in said] == ["CUDA (NVIDIA H200)", denoise.PROCESSOR]
    assert "out of memory" in said[1].detail and library.released == 1 and steps == [denoise_main.NICENESS]


def test_the_process_is_told_its_gpu_and_says_where_it_works(caplog: pytest.LogCaptureFixture) -> None:
    """Twice: its second process finds what the first one did, which is logged once. No library knows that GPU."""
    heard: list[str] = []
    client = DenoiseClient(0, heard.append)
    with caplog.at_level(logging.WARNING):
        for _ in range(2):
            client.start()
            client.sleep(timeout_s=60)
            client.hear()
            client.close()
    assert heard == [denoise.PROCESSOR]
    (record,) = caplog.records
    assert "the processor denoises" in record.getMessage()


@pytest.mark.parametrize("part", ["cuda", "hip", "sycl"])
def test_the_package_has_the_library_s_parts_for_gpus(part: str) -> None:
    """Which the image has with it; another build of pyoidn may come without."""
    folder = Path(pyoidn.__file__).parent / "oidn" / "lib"
    assert list(folder.glob(f"libOpenImageDenoise_device_{part}.so.*"))
