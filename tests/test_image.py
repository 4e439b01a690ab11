"""The container's image: built, and run as its user on a read-only root. `make image-test`; takes minutes and 6 GB.

No registry is asked: the base is a Debian made by debootstrap under the base's name. Docker is not asked for either:
buildah builds in a chroot, and what a runtime would do (mounts, user, no capabilities) is done here.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import httpx
import pytest

from tests.serving import SCENE, SMALL

ROOT = Path(__file__).parents[1]
READY_S = 120.0  # with cold caches, on a busy machine
BASE = "python:3.13-slim-trixie"
DIGEST = r"@sha256:[0-9a-f]{64}\b"
PASSED_ON = ("/etc/ssl/certs", "/etc/pip.conf")  # the ways of this machine to the package index
DEVICES = ("null", "zero", "full", "random", "urandom")

pytestmark = pytest.mark.skipif("SUNBOX_IMAGE" not in os.environ, reason="takes minutes: make image-test")


@dataclass
class Image:
    root: Path
    config: dict[str, Any]

    def command(self, *words: str) -> list[str]:
        """Runs them in the image as a runtime would with --cap-drop ALL, within namespaces that were made already."""
        user = self.config["User"]
        dropped = ["--clear-groups", "--bounding-set=-all", "--inh-caps=-all", "--no-new-privs"]
        started = ["env", "-i", *self.config["Env"], *words]
        return ["chroot", str(self.root), "setpriv", f"--reuid={user}", f"--regid={user}", *dropped, *started]


def run(*command: str | Path) -> str:
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, f"{command}\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}"
    return done.stdout.strip()


@pytest.fixture(scope="module")
def image() -> Iterator[Image]:
    missing = [name for name in ("buildah", "debootstrap", "unshare") if shutil.which(name) is None]
    if missing or os.geteuid() != 0:
        pytest.skip(f"needs root, and {', '.join(missing)}" if missing else "needs root")
    with TemporaryDirectory(prefix="sunbox-image-") as folder:
        store = ["--storage-driver", "vfs", "--root", f"{folder}/images", "--runroot", f"{folder}/run"]
        buildah = ["buildah", *store]
        _make_base(Path(folder), buildah)
        mounts = [f"--volume={path}:{path}:ro" for path in PASSED_ON if os.path.exists(path)]
        build = ["--isolation", "chroot", "--format", "docker", "--pull-never", *mounts]
        file = Path(folder, "Dockerfile")
        file.write_text(re.sub(DIGEST, "", (ROOT / "Dockerfile").read_text()))  # the base is one that was just made
        run(*buildah, "build", *build, "-t", "sunbox", "-f", file, ROOT)
        container = run(*buildah, "from", "--pull-never", "sunbox")
        config = json.loads(run(*buildah, "inspect", "--type", "image", "sunbox"))["Docker"]["config"]
        yield Image(Path(run(*buildah, "mount", container)), config)
        run(*buildah, "umount", container)


def _make_base(folder: Path, buildah: list[str]) -> None:
    bases = re.findall(r"^FROM (\S+)", (ROOT / "Dockerfile").read_text(), re.MULTILINE)
    assert {re.sub(DIGEST, "", base) for base in bases} == {BASE}
    suite = BASE.rpartition("-")[2]
    run("debootstrap", "--variant=minbase", "--include=python3,python3-venv,ca-certificates", suite, folder / "base")
    (folder / "base/usr/bin/python").symlink_to("python3")
    # Without what has no business in an image: devices are not allowed in there, packages' files only take room.
    run(
        "tar",
        "-C",
        folder / "base",
        "--exclude=./dev/*",
        "--exclude=./var/cache/apt/*",
        "-cf",
        folder / "base.tar",
        ".",
    )
    shutil.rmtree(folder / "base")
    container = run(*buildah, "from", "scratch")
    run(*buildah, "add", "-q", container, folder / "base.tar", "/")
    run(*buildah, "commit", "-q", "--rm", container, f"docker.io/library/{BASE}")
    (folder / "base.tar").unlink()


@contextmanager
def contained(image: Image, data: Path, *words: str) -> Iterator[int]:
    """Runs the image's entry point in namespaces of its own, as the first process there; its id out here."""
    root = image.root
    mounts = [
        f"mount --bind {root} {root}",
        f"mount -t tmpfs dev {root}/dev",
        *(f"cp -a /dev/{name} {root}/dev/" for name in DEVICES),
        f"mount -t proc proc {root}/proc",
        f"mount --bind {data} {root}/data",
        f"mount -o remount,bind,ro {root}",
        'exec "$@"',
    ]
    namespaces = ["unshare", "--mount", "--pid", "--ipc", "--fork", "--kill-child"]
    entry = image.command(*image.config["Entrypoint"], *words)
    with (data.parent / "log").open("wb") as log:
        outer = subprocess.Popen([*namespaces, "sh", "-ec", "\n".join(mounts), "sh", *entry], stdout=log, stderr=log)
    try:
        while not (children := Path(f"/proc/{outer.pid}/task/{outer.pid}/children").read_text().split()):
            assert outer.poll() is None
            time.sleep(0.01)
        yield int(children[0])
    finally:
        outer.kill()
        outer.wait()


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


def test_it_renders_as_its_user_on_a_read_only_root(image: Image, tmp_path: Path) -> None:
    assert image.config["User"] == "10001" and image.config["Cmd"] == ["serve"]
    (data := tmp_path / "data").mkdir()
    os.chown(data, 10001, 10001)
    port, until = free_port(), time.monotonic() + READY_S
    with contained(image, data, *image.config["Cmd"], "--host", "127.0.0.1", "--port", str(port)) as server:
        with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=READY_S) as client:
            log = (tmp_path / "log").read_text
            while True:
                try:
                    if client.get("/readyz").status_code == 200:
                        break
                except httpx.ConnectError:
                    pass
                assert time.monotonic() < until, log()
                time.sleep(0.2)
            answer = client.post("/v1/render?format=png", json={"scene": SCENE, "settings": SMALL})
            assert answer.status_code == 200 and answer.content.startswith(b"\x89PNG"), log()
            print(client.get("/v1/info").json()["renderer"])
        inside = ["nsenter", f"--target={server}", "--mount", "--pid", *image.command()]
        health = image.config["Healthcheck"]["Test"]
        assert health[0] == "CMD" and run(*inside, *health[1:]) == ""
        written = subprocess.run([*inside, "touch", "/tmp/file"], capture_output=True, text=True)
        assert "Read-only file system" in written.stderr
        owners = {path.stat().st_uid for path in data.rglob("*")}
        assert owners == {10001}
        os.kill(server, signal.SIGTERM)
        while os.path.exists(f"/proc/{server}"):
            time.sleep(0.05)
        assert time.monotonic() < until + READY_S
    assert "warning" not in log() and "Traceback" not in log()
