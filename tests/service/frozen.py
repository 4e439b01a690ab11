"""Data folders as earlier revisions of Sunbox left them, and how the next one is made.

A folder here is for ever: whatever changes later has to open it. Each release adds one, and so does each migration,
made by the revision before it:

    git checkout REVISION && .venv/bin/python -m tests.service.frozen NAME

runs that revision's own server for some seconds, kills it in the middle of a render, and writes the folder
`tests/service/folders/NAME` (30 KB). It is named as the release, or as the version of its tables; `MADE_BY` says
which revision made it. What is stored in a new way since the last one comes into `_fill` beforehand.

    documents.sql   the database, as `.dump` of SQLite's shell writes it, and its `user_version`
    assets/         as they lay there
    renders/        the same, where that version had stored renders
"""

from __future__ import annotations

import shutil
import sqlite3
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path
from typing import Any

from service.server.renders.store.store import RenderStore
from service.server.storage.database import FILE
from tests.serving import SCENE, Server, kill

FOLDERS = Path(__file__).parent / "folders"
MADE_BY = {
    "0": "0409cd4",
    "1": "ab88cfc",
    "2": "366adc8",
    "3": "19a5ccc",
    "4": "6643dc0",
    "5": "4213a40",
    "6": "5250b9c",
    "7": "2bdc3dd",
    "8": "944d792",
    "9": "64a7ca7",
    "10": "54ea1eb4",
    "11": "a8829095",
}
NAMES = sorted(MADE_BY)
PARTS = ("assets", "renders")

OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
TINY = {"width": 8, "height": 8}
KEY = {"authorization": "Bearer anna"}


def opened(name: str, folder: Path) -> Path:
    """That folder, made again in `folder`."""
    for part in PARTS:
        (folder / part).mkdir(parents=True)
        if (FOLDERS / name / part).exists():
            shutil.copytree(FOLDERS / name / part, folder / part, dirs_exist_ok=True)
    with closing(sqlite3.connect(folder / FILE)) as made:
        made.execute("PRAGMA journal_mode = WAL")
        made.executescript((FOLDERS / name / "documents.sql").read_text())
    return folder


def main(name: str) -> None:
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        _fill(folder)
        shutil.rmtree(FOLDERS / name, ignore_errors=True)
        for part in PARTS:
            shutil.copytree(folder / "data" / part, FOLDERS / name / part)
        with closing(sqlite3.connect(folder / "data" / FILE)) as file:
            (version,) = file.execute("PRAGMA user_version").fetchone()
            dump = [*file.iterdump(), f"PRAGMA user_version = {version};"]
        (FOLDERS / name / "documents.sql").write_text("\n".join(dump) + "\n")


def _fill(folder: Path) -> None:
    """Documents and an asset without an owner, and an owner's renders: one gone, which a key still names, one done,
    one cancelled, one failed, one under way with a checkpoint, and one that waits; and a batch whose first renders
    wait."""
    first = Server(folder)
    asset = first.http.post("/v1/assets", content=OBJ).raise_for_status().json()["id"]
    clay = {"type": "diffuse", "albedo": 0.6}
    scene = {
        "version": 1,
        "camera": {"position": [0, 0, 4], "target": [0, 0, 0]},
        "environment": {"type": "constant", "radiance": 0.5},
        "materials": {"clay": clay},
        "shapes": [{"type": "mesh", "asset": asset, "material": "clay"}],
    }
    first.http.put("/v1/documents/scenes/bunny?title=The bunny", json=scene).raise_for_status()
    grey = {"type": "diffuse", "albedo": [0.1, 0.2, 0.3]}
    first.http.put("/v1/documents/materials/grey", json=grey).raise_for_status()
    assert first.stop() == 0

    def started() -> Server:
        limits = {"SUNBOX_MAX_RUNNING": "1", "SUNBOX_KEEP_RENDERS": "3", "SUNBOX_CHECKPOINT_S": "0.1"}
        server = Server(folder, SUNBOX_API_KEY="anna", **limits)
        server.http.headers.update(KEY)
        return server

    second = started()

    def sent(samples: int, label: str, of: Any = SCENE, key: str = "") -> str:
        body = {"scene": of, "settings": {**TINY, "max_samples": samples, "denoise": False}, "label": label}
        headers = {"idempotency-key": key} if key else {}
        return str(second.http.post("/v1/renders", json=body, headers=headers).raise_for_status().json()["id"])

    def ended(id: str) -> str:
        return str(second.http.get(f"/v1/renders/{id}?wait=30").raise_for_status().json()["state"])

    assert second.http.post("/v1/assets", content=OBJ).raise_for_status().json()["id"] == asset
    gone = sent(4, "gone", key="once")
    assert ended(gone) == "done"
    assert ended(sent(8, "done", scene)) == "done"
    cancelled = sent(1 << 24, "cancelled")
    lost = second.http.post("/v1/assets", content=OBJ + b"# lost\n").raise_for_status().json()["id"]
    failed = sent(8, "failed", {**scene, "shapes": [{**scene["shapes"][0], "asset": lost}]})
    for file in (folder / "data" / "assets").glob(lost.removeprefix("sha256:") + "*"):
        file.unlink()
    while not (folder / "data" / "renders" / f"{cancelled}.checkpoint").exists():
        time.sleep(0.01)
    kill(second)
    second = started()  # which packs again what waits
    while second.http.get(f"/v1/renders/{cancelled}").json()["state"] != "running":
        time.sleep(0.01)
    second.http.delete(f"/v1/renders/{cancelled}").raise_for_status()
    assert ended(failed) == "failed"
    running = sent(1 << 14, "running")
    sent(8, "queued")
    while not (folder / "data" / "renders" / f"{running}.checkpoint").exists():
        time.sleep(0.01)
    over = [{"path": "/materials/ball/roughness", "values": [0.1, 0.5, 0.9]}]
    body = {"scene": SCENE, "settings": {**TINY, "max_samples": 8, "denoise": False}, "over": over, "label": "batch"}
    second.http.post("/v1/batches", json=body).raise_for_status()
    while len(RenderStore(folder / "data").members()) < 2:  # as many as are put in line at a time
        time.sleep(0.01)
    assert second.http.get(f"/v1/renders/{gone}").status_code == 410
    kill(second)


if __name__ == "__main__":
    main(sys.argv[1])
