"""SUNBOX_DEVICES: which renderers there are, what each gets of the machine, and what ends the start."""

from __future__ import annotations

import errno
import os
import re
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest

from gpu import ContextError, Renderer, devices, egl, software_device
from service import config as configs
from service.config import Config, ConfigError, load_config
from service.ipc import channel
from service.renderers.local import process
from service.renderers.local.process import THREADS, Options
from service.renderers.pool import devices as seating
from service.renderers.pool.devices import NoDevices, missing_device, of_cuda, renderer_specs
from service.server import launch
from service.system.child_processes import inherited_environment
from service.worker import list_devices
from service.worker.helpers import compile_main
from tests.serving import Server

GPU, PROCESSOR = {"name": "/dev/dri/card0", "software": False}, {"name": "software", "software": True}


@pytest.fixture
def five_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(configs, "cores", lambda: 5)
    monkeypatch.setattr(seating, "cores", lambda: 5)
    monkeypatch.setattr(launch, "cores", lambda: 5)


def test_one_renderer_where_nothing_is_said() -> None:
    (seat,) = renderer_specs(Config(device=3, gpu_memory=7), 1000)
    assert (seat.place.id, seat.place.device, seat.options.device, seat.options.software) == ("0", "3", 3, False)
    assert (seat.options.memory, seat.options.host_memory, seat.options.cores) == (7, 1000, None)


def test_a_renderer_for_each_device() -> None:
    first, second = renderer_specs(load_config(devices=" 2, 00", gpu_memory=7), 1000)
    assert (first.place.id, first.place.device, first.options.device) == ("0", "2", 2)
    assert (second.place.id, second.place.device, second.options.device) == ("1", "0", 0)
    assert first.options.memory == 7, "each has a memory of its own"
    assert first.options.host_memory == 500, "and where the processor is one of them, its share of the machine's"


def test_renderers_on_the_processor_divide_it(five_cores: None) -> None:
    found = renderer_specs(load_config(devices="llvmpipe:3", gpu_memory=600), 1000)
    assert [seat.place.id for seat in found] == ["0", "1", "2"]
    assert [seat.options.cores for seat in found] == [2, 2, 1]
    assert {seat.place.device for seat in found} == {"llvmpipe"} and all(seat.options.software for seat in found)
    assert {(seat.options.memory, seat.options.host_memory) for seat in found} == {(200, 333)}


def test_more_renderers_than_cores_are_slow_and_have_one_each(
    five_cores: None, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def taken(*_: object) -> None:
        raise OSError(errno.EADDRINUSE, "Address already in use")

    config = load_config(devices="llvmpipe:7")
    assert [seat.options.cores for seat in renderer_specs(config, 1000)] == [1] * 7
    monkeypatch.setattr(launch, "missing_device", lambda config: None)
    monkeypatch.setattr(launch, "listen", taken)
    for value, warned in (("llvmpipe:7", True), ("llvmpipe:5", False), ("0,1", False)):
        caplog.clear()
        assert launch.run(load_config(devices=value)) == 1
        assert ("more renderers on the processor than it has cores" in caplog.text) is warned


@pytest.mark.parametrize(
    ("value", "told"),
    [
        ("gpu", "'gpu' is no device; write numbers"),
        ("0,llvmpipe:2", "'llvmpipe:2' is no device; .* llvmpipe:N alone"),
        ("llvmpipe", "'llvmpipe' is no device"),
        ("0,", "'' is no device"),
        ("-1", "'-1' is no device"),
        ("0,1,00", "device 0 is named twice"),
        ("llvmpipe:0", "from 1 to 16; one for each core"),
        ("llvmpipe:17", "from 1 to 16; one for each core"),
        ("llvmpipe:two", "from 1 to 16; one for each core"),
    ],
)
def test_what_is_no_device_is_named(value: str, told: str, five_cores: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUNBOX_DEVICES", value)
    with pytest.raises(ConfigError, match=rf"^SUNBOX_DEVICES: .*{told}"):
        load_config()


def test_one_device_or_several(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUNBOX_DEVICE", "0")
    monkeypatch.setenv("SUNBOX_DEVICES", "0,1")
    with pytest.raises(ConfigError, match=r"^SUNBOX_DEVICES: cannot be set .* with SUNBOX_DEVICE; keep one"):
        load_config()
    monkeypatch.setenv("SUNBOX_DEVICES", "")
    assert load_config().devices == [] and load_config().software_renderers == 0


@pytest.mark.parametrize(
    ("value", "gpus_only", "listed", "told"),
    [
        ("0,2", False, [GPU, PROCESSOR], "there is no EGL device 2; EGL has 0 (/dev/dri/card0), 1 (software)"),
        ("0", False, [], "there is no EGL device 0; EGL has none at all"),
        ("0,1", True, [GPU, PROCESSOR], "SUNBOX_REQUIRE_GPU forbids"),
        ("llvmpipe:1", True, [PROCESSOR], "SUNBOX_REQUIRE_GPU forbids"),
        ("llvmpipe:1", False, [GPU], "llvmpipe is not installed; EGL has 0 (/dev/dri/card0)"),
        ("0,1", False, [GPU, PROCESSOR], None),
        ("0", True, [GPU, PROCESSOR], None),
        ("llvmpipe:1", False, [GPU, PROCESSOR], None),
    ],
)
def test_devices_that_are_not_there(value: str, gpus_only: bool, listed: list[Any], told: str | None) -> None:
    reason = seating._missing(load_config(devices=value, require_gpu=gpus_only), listed)
    assert reason is None if told is None else reason is not None and "SUNBOX_DEVICES" in reason and told in reason


def test_egl_lists_its_devices(gpu: Renderer, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    found = devices()
    assert found[software_device()].software
    assert missing_device(Config()) is None and missing_device(load_config(devices="0")) is None
    names = ", ".join(f"{i} ({device.name})" for i, device in enumerate(found))
    environment = {**os.environ, "SUNBOX_DEVICES": "0,99", "SUNBOX_DATA_DIR": str(tmp_path)}
    command = [sys.executable, "-m", "service.cli", "serve", "--port", "0"]
    answer = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)
    assert answer.returncode == 1 and answer.stdout == "" and "Traceback" not in answer.stderr
    assert f"SUNBOX_DEVICES: there is no EGL device 99; EGL has {names}" in answer.stderr
    monkeypatch.setattr(seating, "LISTING", "service.no_such_module")
    assert "could not be listed" in (missing_device(load_config(devices="0")) or "")


def test_devices_are_named_as_opengl_names_them(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """And one without OpenGL as EGL and Linux do."""
    software = software_device()

    def some(device: int) -> Renderer:
        if device == 1:
            raise ContextError("MIG")
        return Renderer(software)

    cards = [egl.Device("AMD", False, pci="0000:0a:00.0"), egl.Device("NVIDIA, /dev/dri/card0", False)]
    monkeypatch.setattr(list_devices, "devices", lambda: cards)
    monkeypatch.setattr(list_devices, "Renderer", some)
    first, second = list_devices.names()
    assert first == f"{gpu.info['vendor']}, {gpu.info['renderer']}, 0000:0a:00.0"
    assert second == "NVIDIA, /dev/dri/card0, which cannot render"


def test_threads_of_a_renderer_and_its_helpers() -> None:
    given = process._environment(Options(cores=3))
    assert {given[name] for name in THREADS} == {"3"} and given["PATH"]
    assert process._environment(Options()) == inherited_environment()


def test_a_server_with_two(two: Server) -> None:
    """It says which they are; each has its share of the cores, and so has what it starts."""
    share = configs.cores() // 2
    for worker in two.renderers():
        threads = [(path / "comm").read_text() for path in Path(f"/proc/{worker}/task").iterdir()]
        assert sum(name.startswith("llvmpipe-") for name in threads) - share in (0, 1)
    found = two.http.get("/v1/info").json()
    assert [(each["id"], each["device"]) for each in found["renderers"]] == [("0", "llvmpipe"), ("1", "llvmpipe")]
    assert {each["state"] for each in found["renderers"]} == {"ready"}
    assert found["renderer"]["memory_limit"] == found["memory"]["limit"] // 2
    driver = f"{found['renderer']['renderer']} {found['renderer']['version']}"
    assert {each["driver"] for each in found["renderers"]} == {driver}
    assert {each["vendor"] for each in found["renderers"]} == {found["renderer"]["vendor"]}
    metrics = two.http.get("/metrics").text
    for renderer in "01":
        assert f'sunbox_renderer_resident_bytes{{renderer="{renderer}"}} ' in metrics
        assert f'sunbox_renderer_ready{{renderer="{renderer}"}} ' in metrics
    assert "renderer=1" in two.log.read_text()


def test_spare_compilers_wait_for_each_other_and_nobody_for_them(tmp_path: Path) -> None:
    """Those of several renderers have the same list: one of them compiles a kernel, and the others find it."""
    record, done = tmp_path / "kernels" / "kernel", threading.Event()
    mine, theirs = channel.pair()

    def again() -> None:
        with compile_main._alone(record, theirs, compile_main.LOCKS["spare"]):
            done.set()

    with mine, theirs:
        other = threading.Thread(target=again)
        with compile_main._alone(record, theirs, compile_main.LOCKS["spare"]):
            other.start()
            with compile_main._alone(record, theirs, compile_main.LOCKS["now"]):
                assert not done.wait(0.2)
        other.join(10)
        assert done.is_set()


CARDS = [
    {"name": "b", "software": False, "cuda": 1, "uuid": "0b" * 16},
    {"name": "software", "software": True, "cuda": None, "uuid": ""},
    {"name": "a", "software": False, "cuda": 0, "uuid": "0a" * 16},
]
OTHERS = [{"name": "amd", "software": False, "cuda": None, "uuid": ""}]


@pytest.mark.parametrize(
    ("id", "devices", "expected"),
    [
        ("0", CARDS, 2),
        ("1", CARDS, 0),
        ("GPU-0a0a0a0a-0a0a-0a0a-0a0a-0a0a0a0a0a0a", CARDS, 2),
        ("0", OTHERS, 0),
        ("2", CARDS, "none of EGL's devices is the GPU 2 of CUDA; EGL has 0 (b), 1 (software), 2 (a)"),
        ("1", OTHERS, "none of EGL's devices"),
        ("GPU-0c", CARDS, "none of EGL's devices"),
        ("MIG-1", CARDS, "divided by MIG"),
        ("0", [], "EGL has none at all"),
    ],
)
def test_the_gpu_that_ray_gives(id: str, devices: list[dict[str, Any]], expected: int | str) -> None:
    """By CUDA's number or UUID, as EGL's order is its own."""
    if isinstance(expected, int):
        assert of_cuda(id, devices) == expected
    else:
        with pytest.raises(NoDevices, match=re.escape(expected)):
            of_cuda(id, devices)
