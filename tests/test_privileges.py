"""The service needs no privileges: it serves as any user, also among files that another one left."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import gpu.jit  # noqa: F401  # it chooses NUMBA_CACHE_DIR
from gpu import Renderer
from tests.privileges import capabilities, python_of
from tests.serving import SCENE, SMALL, Server, served

USER = 47_123  # nobody's, on any machine
TRIANGLE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
MATERIAL = {"type": "diffuse", "albedo": 0.5}


def user_of(process: int) -> int:
    """Not of who owns its /proc folder: that is root, as the server hides its memory."""
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("Uid:"))


def picture(server: Server) -> bytes:
    answer = server.http.post("/v1/render?format=png", json={"scene": SCENE, "settings": SMALL})
    assert answer.status_code == 200, answer.text
    return answer.content


def test_the_tests_servers_and_renderers_have_no_privileges(server: Server) -> None:
    for process in (server.process.pid, server.renderer()):
        assert capabilities(process) == 0


def test_another_user_can_serve(gpu: Renderer) -> None:
    python = python_of(USER)
    with TemporaryDirectory() as folder:  # pytest's own folders are closed to others
        cache = os.environ["NUMBA_CACHE_DIR"]
        if os.path.exists(cache):  # or half a minute is spent on it
            shutil.copytree(cache, f"{folder}/numba")
        subprocess.run(["chown", "-R", f"{USER}:{USER}", folder], check=True)
        own = {"HOME": folder, "XDG_CACHE_HOME": f"{folder}/cache", "NUMBA_CACHE_DIR": f"{folder}/numba"}
        with served(Path(folder), python=python, **own) as other:
            assert user_of(other.process.pid) == user_of(other.renderer()) == USER
            assert picture(other).startswith(b"\x89PNG")
            assert other.http.post("/v1/assets?format=obj", content=TRIANGLE).status_code == 201
            assert other.http.put("/v1/documents/materials/grey", json=MATERIAL).status_code == 201
        assert "warning" not in other.log.read_text()


def test_what_root_left_behind_keeps_nobody_from_rendering(gpu: Renderer, tmp_path: Path) -> None:
    """After `sudo make run`: caches that no longer can be read, a data folder that cannot be written."""
    # As a cluster starts what it would rather lose.
    raised = ["sh", "-c", 'echo 700 >/proc/self/oom_score_adj && exec "$0" "$@"', sys.executable]
    closed = [tmp_path / "sunbox" / name for name in ("kernels", "assets")]
    for folder in closed:
        folder.mkdir(parents=True)
        folder.chmod(0)
    try:
        with served(
            tmp_path, python=raised, XDG_CACHE_HOME=str(tmp_path), SUNBOX_DATA_DIR=str(tmp_path / "sunbox")
        ) as server:
            assert picture(server).startswith(b"\x89PNG")
            score = Path(f"/proc/{server.renderer()}/oom_score_adj").read_text()
            assert int(score) == 1000  # as only root may lower it, 500 more than the server's 700, or all there is
            answer = server.http.post("/v1/assets?format=obj", content=TRIANGLE)
            assert answer.status_code == 503 and "Permission denied" in answer.json()["detail"]
        log = server.log.read_text()
        assert f"owns {tmp_path}/sunbox/assets and" in log and "SUNBOX_DATA_DIR" in log
        assert "Traceback" not in log and "renderer lost" not in log
    finally:
        for folder in closed:
            folder.chmod(0o700)


def test_a_data_folder_that_may_not_be_looked_into(gpu: Renderer, tmp_path: Path) -> None:
    closed = tmp_path / "closed"
    closed.mkdir(0)
    try:
        with served(tmp_path, SUNBOX_DATA_DIR=str(closed / "sunbox")) as server:
            assert picture(server).startswith(b"\x89PNG")
            for answer in (
                server.http.get("/v1/documents/materials"),
                server.http.put("/v1/documents/materials/grey", json=MATERIAL),
                server.http.post("/v1/assets?format=obj", content=TRIANGLE),
            ):
                assert answer.status_code == 503, answer.text
        log = server.log.read_text()
        assert f"owns {closed} and" in log and "Traceback" not in log
    finally:
        closed.chmod(0o700)


def test_who_may_not_use_the_gpu_is_told(tmp_path: Path) -> None:
    for name, mode in (("renderD128", 0), ("renderD129", 0o600), ("card0", 0)):
        (tmp_path / name).touch(mode)
    program = "import sys, pathlib; from service.worker.__main__ import closed_gpus; "
    program += "print(*closed_gpus(pathlib.Path(sys.argv[1])))"
    told = subprocess.run([sys.executable, "-c", program, tmp_path], capture_output=True, text=True, check=True)
    assert told.stdout.split() == [f"{tmp_path}/renderD128"]
