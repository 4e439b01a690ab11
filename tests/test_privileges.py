"""The service needs no privileges: it serves as any user, also among files that another one left."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import gpu.jit  # noqa: F401  # it chooses NUMBA_CACHE_DIR
from gpu import Renderer
from tests.privileges import capabilities, python_of
from tests.serving import SCENE, SMALL, Server

USER = 47_123  # nobody's, on any machine
TRIANGLE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
MATERIAL = {"type": "diffuse", "albedo": 0.5}


@contextmanager
def served(folder: Path, **options: Any) -> Iterator[Server]:
    server = Server(folder, **options)
    try:
        server.wait()
        yield server
    finally:
        assert server.stop() == 0


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
            assert os.stat(f"/proc/{other.process.pid}").st_uid == os.stat(f"/proc/{other.renderer()}").st_uid == USER
            assert picture(other).startswith(b"\x89PNG")
            assert other.http.post("/v1/assets?format=obj", content=TRIANGLE).status_code == 201
            assert other.http.put("/v1/documents/materials/grey", json=MATERIAL).status_code == 201
        assert "warning" not in other.log.read_text()


def test_what_root_left_behind_keeps_nobody_from_rendering(gpu: Renderer, tmp_path: Path) -> None:
    """After `sudo make run`: caches that no longer can be read, a data folder that cannot be written."""
    closed = [tmp_path / "sunbox" / name for name in ("kernels", "assets")]
    for folder in closed:
        folder.mkdir(parents=True)
        folder.chmod(0)
    try:
        with served(tmp_path, XDG_CACHE_HOME=str(tmp_path), SUNBOX_DATA_DIR=str(tmp_path / "sunbox")) as server:
            assert picture(server).startswith(b"\x89PNG")
            answer = server.http.post("/v1/assets?format=obj", content=TRIANGLE)
            assert answer.status_code == 503 and "Permission denied" in answer.json()["detail"]
        log = server.log.read_text()
        assert f"owns {tmp_path}/sunbox/assets and" in log and "SUNBOX_DATA_DIR" in log
        assert "Traceback" not in log and "renderer lost" not in log
    finally:
        for folder in closed:
            folder.chmod(0o700)
