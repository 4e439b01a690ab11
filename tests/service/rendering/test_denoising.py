"""The setting `denoise` from outside: what is shown, what stays the raw picture's, and that nobody waits for it."""

from __future__ import annotations

import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gpu import Renderer, denoise
from service.cli.program import main
from service.ipc import channel, heartbeat
from service.ipc.messages import Ready
from service.renderers.local.supervisor import Supervisor
from service.worker.helpers.denoise_client import DIED, DenoiseClient, DenoiseResult, denoise_request
from service.worker.loop import Loop
from tests.service.rendering.fakes import FakeProcesses, with_fake_processes
from tests.serving import PATIENCE_S, SCENE, Client, Server
from tests.serving import client as opened

FEW = {"width": 96, "height": 64, "max_samples": 4, "max_bounces": 4}
ENDLESS = {**FEW, "max_samples": 1 << 24, "estimator": "uniform", "denoise": True}  # for long noisy enough
RAW = {"format": "rgba32f"}


@pytest.fixture
def client(server: Server) -> Iterator[Client]:
    with opened(server) as connected:
        yield connected


def finished(server: Server, settings: Any) -> tuple[dict[str, Any], np.ndarray, np.ndarray]:
    """Its last status, colour and variance."""
    id = server.http.post("/v1/renders", json={"scene": SCENE, "settings": settings}).json()["id"]
    status = server.http.get(f"/v1/renders/{id}", params={"wait": PATIENCE_S}).json()
    return status, *(image(server, id, aov) for aov in ("color", "variance"))


def image(server: Server, id: str, aov: str = "color") -> np.ndarray:
    answer = server.http.get(f"/v1/renders/{id}/image", params={"format": "npy", "aov": aov})
    assert answer.status_code == 200, answer.text
    loaded: np.ndarray = np.load(io.BytesIO(answer.content))
    return loaded


def rmse(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.sqrt(np.mean((a[..., :3].astype(float) - b[..., :3]) ** 2)))


@pytest.fixture(scope="module")
def raw(server: Server) -> tuple[dict[str, Any], np.ndarray, np.ndarray]:
    return finished(server, FEW)


@pytest.fixture(scope="module")
def reference(server: Server) -> np.ndarray:
    return finished(server, {**FEW, "max_samples": 400, "seed": 3})[1]


def test_a_render_is_denoised_and_its_noise_stays_the_raw_one(server: Server, raw: Any, reference: Any) -> None:
    status, color, variance = finished(server, {**FEW, "denoise": True})
    assert status["state"] == "done" and status["settings"]["denoise"] is True and status["warnings"] == []
    assert status["noise"] == raw[0]["noise"] > 0.02
    assert np.array_equal(variance, raw[2]) and np.array_equal(color[..., 3], raw[1][..., 3])
    assert rmse(color, reference) < 0.5 * rmse(raw[1], reference)
    assert np.array_equal(finished(server, {**FEW, "denoise": True})[1], color)


def test_info_says_where_pictures_are_denoised(server: Server) -> None:
    told = server.http.get("/v1/info").json()["renderer"]["denoiser"]
    assert re.fullmatch(r"Open Image Denoise \(pyoidn [\d.]+\) on the processor", told)


def test_beside_a_gpu_its_process_is_asked(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """At the start, by EGL's number. The library has no part for this one, which is what info has from then on."""
    monkeypatch.setitem(gpu.info, "software", False)
    mine, its = channel.pair()
    memory = heartbeat.memory()
    loop = Loop(its, gpu, heartbeat.Heartbeat(memory), 1 << 30, None, 1.0, ahead="off")
    os.close(memory)
    said = list[Any]()

    def listen() -> None:
        while not (said and isinstance(said[-1], Ready)):
            said.append(channel.receive(mine, wait=True))
        mine.close()

    with ThreadPoolExecutor(1) as ears, pytest.raises(channel.Closed):
        ears.submit(listen)
        loop.run()
    loop._denoiser.close()
    assert said[-1].info == {"denoiser": denoise.version(denoise.PROCESSOR)}


def test_what_a_renderer_says_later_is_added_to_what_it_said() -> None:
    processes = FakeProcesses()

    async def test(supervisor: Supervisor) -> None:
        before, driver = dict(await supervisor.ready(PATIENCE_S)), supervisor.driver
        processes.now.say(Ready({"denoiser": "on CUDA"}))
        assert supervisor.info == {**before, "denoiser": "on CUDA"} and supervisor.driver == driver

    with_fake_processes(test, processes)


def test_one_shot_is_denoised(server: Server, raw: Any, reference: Any) -> None:
    body = {"scene": SCENE, "settings": {**FEW, "denoise": True}}
    answer = server.http.post("/v1/render", json=body, params={"format": "npy"})
    assert rmse(np.load(io.BytesIO(answer.content)), reference) < 0.5 * rmse(raw[1], reference)


def test_a_clean_picture_is_left_alone(server: Server) -> None:
    clean = {**FEW, "max_samples": 4096, "max_bounces": 1, "width": 24, "height": 16}
    status, color, _ = finished(server, {**clean, "denoise": True})
    assert status["noise"] < 0.005 and np.array_equal(color, finished(server, clean)[1])


def test_a_running_render_may_be_looked_at(server: Server) -> None:
    settings = {**FEW, "max_samples": 1 << 24, "denoise": True}
    id = server.http.post("/v1/renders", json={"scene": SCENE, "settings": settings}).json()["id"]
    while server.http.get(f"/v1/renders/{id}").json()["samples"] == 0:
        time.sleep(0.01)
    pictures = [image(server, id) for _ in range(3)]
    assert server.http.delete(f"/v1/renders/{id}").status_code == 204
    assert all(np.isfinite(picture).all() for picture in [*pictures, image(server, id)])


def test_a_stream_shows_the_raw_picture_first_and_ends_denoised(client: Client, raw: Any, reference: Any) -> None:
    client.start(settings={**FEW, "denoise": True}, view=RAW)
    first = client.frame()
    done, last = client.finished()
    assert "denoised" not in first.header and last.header["denoised"] is True
    assert last.samples == done["samples"] == 4 and last.noise == done["noise"] == raw[0]["noise"]
    assert rmse(last.array(), reference) < 0.5 * rmse(raw[1], reference)


def test_switching_it_starts_nothing_again(client: Client, raw: Any) -> None:
    client.start(settings=FEW, view=RAW)
    before = client.finished()[1]
    assert np.array_equal(before.array(), raw[1])
    client.say("update", generation=2, settings={"denoise": True})
    done, last = client.finished()
    assert done["samples"] == last.samples == 4
    while not last.header.get("denoised"):
        last = client.frame(generation=2)
    assert last.samples == 4 and rmse(last.array(), before.array()) > 0
    client.say("view", exposure=1)
    assert client.frame(generation=2).header["denoised"]
    client.say("update", generation=3, settings={"denoise": False})
    assert np.array_equal(client.finished()[1].array(), before.array())


@pytest.mark.slow
def test_a_long_stream_shows_denoised_frames_that_rise(client: Client) -> None:
    client.start(settings=ENDLESS, view=RAW)
    frames = [client.frame()]
    while not frames[-1].header.get("denoised"):  # on a busy machine they come raw for as long as its helper starts
        frames.append(client.frame())
    frames += [client.frame() for _ in range(4)]
    assert [frame.samples for frame in frames] == sorted(frame.samples for frame in frames)
    client.say("update", generation=2, scene={"materials": {"ball": {"roughness": 0.9}}})
    assert "denoised" not in client.frame(generation=2).header


def test_a_stream_goes_on_when_its_denoiser_does_not(server: Server, client: Client) -> None:
    client.start(settings=ENDLESS, view=RAW)
    while not client.frame().header.get("denoised"):
        pass
    search = ["pgrep", "-P", str(server.renderer()), "-f", "denoise_main"]
    helper = int(subprocess.run(search, capture_output=True, text=True).stdout)
    os.kill(helper, signal.SIGSTOP)
    try:
        while client.frame().header.get("denoised"):
            pass
        first, second = client.frame(), client.frame()
        assert second.samples > first.samples and "denoised" not in first.header | second.header
    finally:
        os.kill(helper, signal.SIGCONT)
    client.say("update", generation=2, scene={"materials": {"ball": {"roughness": 0.9}}})
    while not client.frame().header.get("denoised"):
        pass


@pytest.fixture(scope="module")
def broken(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment variables with which the library is there and does not load."""
    folder = tmp_path_factory.mktemp("broken")
    (folder / "pyoidn.py").write_text("raise ImportError('libOpenImageDenoise.so.2: no such file')\n")
    return {"PYTHONPATH": os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", os.getcwd())])}


def test_without_the_library_the_service_says_so_and_goes_on(
    broken: dict[str, str], tmp_path: Path, raw: Any
) -> None:
    server = Server(tmp_path, **broken)
    try:
        server.wait()
        for _ in range(2):
            status, color, _ = finished(server, {**FEW, "denoise": True})
            assert status["state"] == "done" and np.array_equal(color, raw[1])
            assert any("Open Image Denoise" in w and "no such file" in w for w in status["warnings"]), status
        with opened(server) as client:
            client.start(settings={**FEW, "denoise": True}, view=RAW)
            assert np.array_equal(client.finished()[1].array(), raw[1])
    finally:
        server.stop()


def test_the_command_line_denoises(tmp_path: Path, raw: Any, reference: Any) -> None:
    (tmp_path / "scene.json").write_text(json.dumps(SCENE))
    out, options = tmp_path / "out.npy", [f"{name}={value}" for name, value in FEW.items()]
    for option in ("denoise=true", "denoise=false"):
        chosen = [word for pair in [*options, option] for word in ("--set", pair)]
        assert main(["render", str(tmp_path / "scene.json"), "-o", str(out), *chosen]) == 0
        if option == "denoise=true":
            assert rmse(np.load(out), reference) < 0.5 * rmse(raw[1], reference)
    assert np.array_equal(np.load(out), raw[1])


def test_a_denoiser_that_dies_is_replaced_and_then_given_up() -> None:
    denoiser, told = DenoiseClient(), list[DenoiseResult]()
    color, guide = np.random.default_rng(1).random((32, 32, 4), np.float32), np.ones((32, 32, 3), np.float32)

    def ask(kill: bool) -> DenoiseResult:
        if kill and denoiser.process_id is not None:
            os.kill(denoiser.process_id, signal.SIGSTOP)  # or it may have answered by the time that it is killed
        denoiser.ask(denoise_request(color, (guide, guide), fine=False), told.append)
        assert denoiser.busy
        if kill:
            assert denoiser.process_id is not None
            os.kill(denoiser.process_id, signal.SIGKILL)
        while denoiser.busy:
            denoiser.sleep(timeout_s=20)
            denoiser.hear()
        return told[-1]

    assert ask(kill=True) == DenoiseResult(None, DIED)
    good = ask(kill=False)
    assert good.pixels is not None and good.pixels.shape == color.shape and denoiser.missing is None
    for last in (False, False, True):
        assert ask(kill=True).missing is last
    assert denoiser.missing == DIED
    denoiser.close()


def test_the_helper_ends_with_its_parent() -> None:
    program = (
        "import sys, numpy as np\n"
        "from service.worker.helpers.denoise_client import DenoiseClient, denoise_request\n"
        "d = DenoiseClient(); a = np.ones((64, 64, 4), np.float32)\n"
        "d.ask(denoise_request(a, (a[..., :3], a[..., :3]), True), print)\n"
        "sys.stdout.write(str(d.process_id)); sys.stdout.flush()\n"
        "import os; os._exit(0)"
    )
    pid = int(subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=30).stdout)
    until = time.monotonic() + 10
    while Path(f"/proc/{pid}/stat").exists() and Path(f"/proc/{pid}/stat").read_text().split()[2] != "Z":
        assert time.monotonic() < until
        time.sleep(0.05)
