"""A Ray that is not there, does not answer, is not installed, or runs other code: an error names the variable."""

from __future__ import annotations

import asyncio
import importlib.util
import os
import socket
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from service.config import ConfigError, load_config
from service.ipc import channel
from service.ipc.messages import Unable, Update
from service.ipc.server_end import Channel
from service.renderers.local.process import NoPlace
from service.renderers.ray import actor, carriage, lane
from service.renderers.ray.carriage import Scenes, digest
from service.renderers.ray.cluster import Cluster
from service.renderers.ray.control import ProcessEnded
from service.renderers.ray.joining import CannotJoin, close_token_file
from service.renderers.ray.lane import Lane
from service.renderers.ray.renderers import described, plan
from service.server.state import AppState
from tests.service.rendering.cluster.clusters import OPTIONS, until
from tests.serving import PATIENCE_S
from tests.supervisors import arrays_of


@pytest.mark.parametrize(
    ("nodes", "wanted", "expected"),
    [
        ([{"GPU": 2, "CPU": 8}, {"GPU": 1, "CPU": 4}, {"CPU": 16}], None, (3, {"GPU": 1, "CPU": 1})),
        ([{"GPU": 2, "CPU": 8}], 5, (5, {"GPU": 1, "CPU": 1})),
        ([{"CPU": 8}, {"CPU": 6}], None, (2, {"CPU": 6})),
        ([{"CPU": 0}, {"CPU": 8}], None, (1, {"CPU": 8})),  # a head that shall not render
        ([{"CPU": 8}, {"CPU": 6}], 4, (4, {"CPU": 3})),  # two each; with four processors there were only three
        ([{"CPU": 2}], 3, (3, {"CPU": 1})),
        ([{"CPU": 0}], None, (1, {"CPU": 1})),  # a cluster that has yet to grow
    ],
)
def test_a_renderer_declares_what_it_takes(nodes: Any, wanted: int | None, expected: Any) -> None:
    assert plan(nodes, wanted) == expected


def test_gpus_are_demanded_before_there_are_any() -> None:
    assert plan([{"CPU": 4}], None, gpu=True) == (1, {"GPU": 1, "CPU": 1})
    assert described({"CPU": 2.0, "GPU": 1.0}) == "1 GPU and 2 CPU"


@pytest.mark.parametrize(
    ("variables", "said"),
    [
        ({"ray": "nonsense"}, "SUNBOX_RAY: 'nonsense' is neither HOST:PORT nor auto"),
        ({"ray": "ray://head:10001"}, "SUNBOX_RAY: is not the address of Ray's client"),
        ({"ray": "auto", "device": 0}, "SUNBOX_RAY: cannot be set together with SUNBOX_DEVICE;"),
        ({"ray": "auto", "devices": "llvmpipe:1"}, "SUNBOX_RAY: cannot be set together with SUNBOX_DEVICES;"),
        ({"ray_renderers": 2}, "SUNBOX_RAY_RENDERERS: says how many renderers a Ray cluster has; set SUNBOX_RAY"),
    ],
)
def test_settings_that_make_no_sense(variables: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=f"^{said}"):
        load_config(**variables)
    assert load_config(ray="[::1]:6379", ray_renderers=2).ray == "[::1]:6379"


def test_ray_is_not_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(CannotJoin, match=r"^SUNBOX_RAY .* pip install 'ray>="):
        Cluster("auto", None, False, OPTIONS)


def closed_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


@pytest.mark.ray
@pytest.mark.slow
@pytest.mark.parametrize("variable", ["SUNBOX_RAY", "RAY_ADDRESS"])
def test_a_server_does_not_start_without_its_cluster(tmp_path: Path, variable: str) -> None:
    address = f"127.0.0.1:{closed_port()}"
    environment = os.environ | {"SUNBOX_DATA_DIR": str(tmp_path), "SUNBOX_RAY": "auto", variable: address}
    command = [sys.executable, "-m", "service.cli", "serve", "--port", "0"]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=PATIENCE_S)
    assert ended.returncode == 1 and ended.stdout == ""
    assert f"no Ray cluster answers at {address}" in ended.stderr and f"{variable}" in ended.stderr
    assert "Traceback" not in ended.stderr


@pytest.mark.parametrize("mode", [0o644, 0o600])
def test_a_token_in_the_home_folder_is_left_to_its_owner(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mode: int
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    close_token_file()  # there is none
    path = tmp_path / ".ray" / "auth_token"
    path.parent.mkdir()
    path.write_text("token")
    path.chmod(mode)
    close_token_file()
    assert path.stat().st_mode & 0o777 == 0o600 and path.read_text() == "token"


@pytest.mark.ray
@pytest.mark.slow
@pytest.mark.parametrize(("mode", "expected"), [("token", "True"), ("disabled", "False")])
def test_a_cluster_without_a_token_is_known(mode: str, expected: str) -> None:
    program = "from service.renderers.ray.joining import has_token; print(has_token())"
    environment = os.environ | {"RAY_AUTH_MODE": mode}
    told = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
    assert told.stdout.strip() == expected, told.stderr


@pytest.mark.ray
@pytest.mark.slow
def test_a_head_that_does_not_answer() -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"127.0.0.1:{silent.getsockname()[1]}"
        with pytest.raises(CannotJoin, match=rf"^SUNBOX_RAY: the Ray cluster \({address}\) gave no answer in 3 s"):
            Cluster(address, None, False, OPTIONS, patience_s=3.0, nodes_s=0.0)


class Method:
    """An actor's method that answers at once."""

    def __init__(self, answer: Any) -> None:
        self._answer = answer

    def options(self, **given: Any) -> Method:
        return self

    def remote(self, *given: Any) -> asyncio.Future[Any]:
        answer = asyncio.get_running_loop().create_future()
        if isinstance(self._answer, Exception):
            answer.set_exception(self._answer)
        elif self._answer is not None:
            answer.set_result(self._answer)
        return answer


class Actors:
    """Fulfils `lane.Actors` with one actor, which describes itself so, or fails; None: it has not been placed."""

    threads = 1

    def __init__(self, description: dict[str, str] | Exception | None) -> None:
        self.scenes, self.options = Scenes(), dict[str, Any]()
        self.describe = Method(description)

    def actor(self, number: int, anew: bool = False) -> Any:
        return self

    def placing(self, number: int) -> str:
        return "There is no room."

    def restart(self, number: int) -> None: ...


async def told(actors: Actors, count: int) -> list[Any]:
    ours, theirs = channel.pair()
    heard = list[Any]()
    link = Channel(ours, heard.append, lambda: None)
    running = asyncio.ensure_future(Lane(0, theirs, actors).run())
    await until(lambda: len(heard) >= count)
    link.close()
    await running
    return heard


@pytest.mark.ray
@pytest.mark.slow
def test_a_node_with_other_code_is_told_apart() -> None:
    unable, ended = asyncio.run(told(Actors({"host": "far", "version": "0.0.9+abc"}), 2))
    assert isinstance(unable, Unable) and ended == ProcessEnded("crashed")
    for word in ("SUNBOX_RAY", "host far", "0.0.9+abc", actor.version()):
        assert word in unable.detail


@pytest.mark.ray
@pytest.mark.slow
def test_a_node_without_sunbox() -> None:
    from ray.exceptions import RayActorError

    died = "The actor died because of an error raised in its creation task, \x1b[36mray::A()\x1b[39m (ip=192.0.2.7)"
    why = "ModuleNotFoundError: No module named 'service'"
    failure = RayActorError(None, f"{died}\n  File ...\n{why}\n")
    unable = asyncio.run(told(Actors(failure), 1))[0]
    assert unable == Unable(f"SUNBOX_RAY: a node of the cluster can't run Sunbox: {why} (on 192.0.2.7)")


def test_the_version_is_of_the_code(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    here = actor.version()
    assert actor.difference("near", here) is None
    (tmp_path / "shaders").mkdir()
    versions = set()
    for text in ("one", "other"):
        (tmp_path / "shaders" / "a.glsl").write_text(text)
        monkeypatch.setattr(actor, "ROOT", tmp_path)
        versions.add(actor.version.__wrapped__())
    assert len(versions | {here}) == 3


@pytest.mark.ray
@pytest.mark.slow
def test_it_says_that_there_is_no_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lane, "PLACING_S", 0.01)
    assert set(asyncio.run(told(Actors(None), 2))) == {NoPlace("There is no room.")}


def test_equal_scenes_have_equal_digests() -> None:
    """Also when they come in different messages, and lie elsewhere in memory."""
    scene = arrays_of("plain")
    received = [channel.decode(*channel.encode(Update(task, 1, scene))).scene for task in (1, 2)]
    assert digest(received[0]) == digest(received[1]) != digest(arrays_of("rich"))


def test_a_cluster_without_a_gpu_yet_is_no_reason_to_end() -> None:
    """Ray's autoscaler may need minutes for the first node."""
    state: Any = SimpleNamespace(config=load_config(require_gpu=True, ray="auto"))
    assert asyncio.run(AppState.gpu_missing(state)) is None


def test_a_scene_is_stored_once_and_freed_after_its_last_task(monkeypatch: pytest.MonkeyPatch) -> None:
    stored = list[Any]()

    async def store(value: Any) -> Any:
        stored.append(value)
        return f"reference {len(stored)}"

    async def test() -> None:
        scenes, first, second = Scenes(), object(), object()
        one, same, other = np.zeros(9), np.zeros(9), np.ones(9)
        put: Any = scenes.put
        assert await asyncio.gather(put((first, 1), one), put((second, 1), same)) == ["reference 1"] * 2
        assert await put((first, 2), other) == "reference 2" and len(scenes) == 2
        scenes.forget((first, 1))
        assert len(scenes) == 2
        assert await put((second, 1), other) == "reference 2" and len(scenes) == 1  # an update of its task
        scenes.forget_all(first)
        assert len(scenes) == 1
        scenes.forget_all(second)
        assert len(scenes) == 0

    monkeypatch.setattr(carriage, "stored", store)
    asyncio.run(test())
