"""What other versions of Sunbox stored of renders is understood; what nobody understands stops no start."""

from __future__ import annotations

import json
import logging
import os
import re
import sqlite3
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from gpu import Renderer
from service.cli.check_data import check_renders
from service.config import Config
from service.ipc.messages import Progress
from service.server.batches.batch import member_id
from service.server.renders.store.rows import stored_renders
from service.server.renders.store.store import RenderStore
from service.server.storage.data_check import Report
from service.server.storage.database import FILE
from service.server.storage.documents import Documents
from service.server.storage.stores import storage
from tests.calls import status
from tests.marks import seldom
from tests.service import frozen
from tests.serving import Server, served, wait_until

WITH_RENDERS = [name for name in frozen.NAMES if (frozen.FOLDERS / name / "renders").exists()]
STATES = {"gone": "done", "done": "done", "cancelled": "cancelled", "failed": "failed", "running": "running"}
STATES |= {"queued": "queued"}

Values = dict[str, Any]


def labelled(folder: Path) -> dict[str | None, Any]:
    """The renders but those of batches."""
    store = RenderStore(folder)
    members = store.members()
    return {each.order.label: each for each in store.load() if each.order.id not in members}


def change(folder: Path, label: str, column: str, to: str) -> None:
    with closing(sqlite3.connect(folder / FILE)) as file, file:
        file.execute(f"UPDATE renders SET {column} = ? WHERE label = ?", (to, label))


def column(folder: Path, label: str, column: str) -> str:
    with closing(sqlite3.connect(folder / FILE)) as file:
        return str(file.execute(f"SELECT {column} FROM renders WHERE label = ?", (label,)).fetchone()[0])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return frozen.opened(WITH_RENDERS[-1], tmp_path)


@pytest.mark.parametrize("name", WITH_RENDERS)
def test_renders_of_every_released_revision_are_read(name: str, tmp_path: Path) -> None:
    folder = frozen.opened(name, tmp_path)
    Documents(folder, storage(Config(data_dir=folder)).assets).prepare()
    found = labelled(folder)
    assert {label: each.outcome.state for label, each in found.items()} == STATES
    assert [label for label, each in found.items() if each.gone] == ["gone"]
    assert not any(each.unfit or each.unknown for each in found.values())
    assert column(folder, "gone", "settings") == "{}"
    assert all(each.order.settings.width == 8 for each in found.values() if not each.gone)
    assert found["running"].outcome.progress.samples > 0 and found["failed"].outcome.error is not None
    store = RenderStore(folder)
    for label, kind in (("done", "picture"), ("cancelled", "picture"), ("running", "checkpoint")):
        assert store.read_now(found[label].order.id, kind, 1).saved.samples > 0
    report = Report()
    assert check_renders(folder, report) == 5 + len(store.members()) and not report.notes
    assert [fault.split(": ")[1][:20] for fault in report.faults] == ["there is no asset sh"]  # it made that one fail


def without(*names: str) -> Callable[[str], str]:
    return lambda text: json.dumps({name: value for name, value in json.loads(text).items() if name not in names})


def having(**values: Any) -> Callable[[str], str]:
    return lambda text: json.dumps(json.loads(text) | values)


@pytest.mark.parametrize(
    ("where", "damage", "said"),
    [
        ("settings", without("clamp"), "settings: clamp"),
        ("settings", having(width="wide"), "settings: width"),
        ("settings", lambda text: text[: len(text) // 2], "settings: it is not whole JSON"),
        ("settings", lambda text: "[" * 100_000, "settings: it is not whole JSON"),
        ("settings", having(version=99), "format 99"),
        ("outcome", lambda text: "[]", "outcome: it is not a JSON object"),
        ("outcome", lambda text: text[:-1], "outcome: it is not whole JSON"),
        ("outcome", having(progress={"samples": "many"}), "outcome: progress.samples"),
        ("outcome", having(problem={"title": "?"}), "outcome: 'detail'"),
        ("state", lambda text: "painted", "outcome: state"),
    ],
)
def test_a_row_that_nobody_understands_is_a_failed_render(
    folder: Path, where: str, damage: Callable[[str], str], said: str, caplog: pytest.LogCaptureFixture
) -> None:
    """Whatever it was; it stays as it is in the database, for the version that understands it."""
    before = labelled(folder)
    for label in ("running", "done"):
        change(folder, label, where, damage(column(folder, label, where)))
    damaged = [column(folder, label, where) for label in ("running", "done")]
    found = labelled(folder)
    for label in ("running", "done"):
        outcome = found[label].outcome
        assert outcome.state == "failed" and outcome.ended_at is not None
        assert said in str(outcome.error) and "Send it again" in str(outcome.error) and said in caplog.text
    others = ["cancelled", "failed", "queued"]
    assert [found[label] for label in others] == [before[label] for label in others]
    assert [column(folder, label, where) for label in ("running", "done")] == damaged
    assert sorted(path.suffix for path in (folder / "renders").iterdir()) == [".checkpoint", ".picture", ".picture"]
    report = Report()
    check_renders(folder, report)
    assert sum(said in fault for fault in report.faults) == 2


def test_a_field_that_came_later_has_its_default(folder: Path) -> None:
    change(folder, "running", "outcome", without("starts", "kernel")(column(folder, "running", "outcome")))
    running = labelled(folder)["running"]
    assert running.unfit is None and running.outcome.starts == 0 and running.outcome.kernel is None


def test_a_field_that_is_no_more_is_left_out(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING, "service")
    before = labelled(folder)
    for label in ("running", "queued"):
        change(folder, label, "settings", having(fancy=1)(column(folder, label, "settings")))
        change(folder, label, "outcome", having(mood="good")(column(folder, label, "outcome")))
    found = labelled(folder)
    for label in ("running", "queued"):
        assert (found[label].order, found[label].outcome) == (before[label].order, before[label].outcome)
    assert caplog.text.count("fields=fancy,mood") == 1  # one line for all


@pytest.mark.parametrize("damage", [having(progress=3), without("samples"), lambda line: "{}", lambda line: "7"])
def test_a_checkpoint_that_nobody_understands_begins_again(folder: Path, damage: Callable[[str], str]) -> None:
    (path,) = (folder / "renders").glob("*.checkpoint")
    line, _, data = path.read_bytes().partition(b"\n")
    path.write_bytes(damage(line.decode()).encode() + b"\n" + data)
    running = labelled(folder)["running"]
    assert running.outcome.state == "running" and running.outcome.progress == Progress()


def test_reading_all_renders_of_a_database_needs_no_start(folder: Path) -> None:
    change(folder, "done", "outcome", "{")
    with closing(sqlite3.connect(folder / FILE)) as file:
        assert [each.unfit is not None for each in stored_renders(file)].count(True) == 1


@pytest.mark.parametrize("name", seldom(WITH_RENDERS, WITH_RENDERS[:-1]))
def test_a_server_goes_on_with_every_released_revision_s_renders(gpu: Renderer, name: str, tmp_path: Path) -> None:
    """Also where one row does not fit."""
    folder = frozen.opened(name, tmp_path / "data")
    ids = {label: each.order.id for label, each in labelled(folder).items()}
    batches = [each.order.id for each in RenderStore(folder).batches.all()]
    assert len(batches) == (int(name) >= 9)
    change(folder, "cancelled", "settings", "{")
    with closing(sqlite3.connect(folder / FILE)) as file, file:  # it was kept for as long as it lies here
        file.execute("UPDATE renders SET ended_at = unixepoch() WHERE ended_at IS NOT NULL")
    served = Server(tmp_path, SUNBOX_API_KEY="anna")
    try:
        served.http.headers.update(frozen.KEY)
        assert served.http.get(f"/v1/renders/{ids['gone']}").status_code == 410
        cancelled = served.http.get(f"/v1/renders/{ids['cancelled']}").raise_for_status().json()
        assert cancelled["state"] == "failed" and "not whole JSON" in cancelled["problem"]["detail"]
        whole = ("done", "running", "queued")
        wait_until(lambda: all(status(served.http, ids[label], wait=30)["state"] == "done" for label in whole))
        for label in whole:
            ended = served.http.get(f"/v1/renders/{ids[label]}").raise_for_status().json()
            assert (ended["state"], ended["label"]) == ("done", label)
            assert served.http.get(f"/v1/renders/{ids[label]}/image?format=npy").status_code == 200
        for id in batches:
            ended = served.http.get(f"/v1/batches/{id}?wait=30").raise_for_status().json()
            assert (ended["state"], ended["counts"]["done"]) == ("done", 3)
    finally:
        assert served.stop() == 0


@pytest.mark.slow  # a server of its own, and a minute for its folder
def test_fifty_thousand_ended_renders_take_rows_and_no_objects(tmp_path: Path) -> None:
    folder, each = frozen.opened("11", tmp_path / "data"), 10_000
    picture = next((folder / "renders").glob("*.picture"))
    with closing(sqlite3.connect(folder / FILE)) as file, file:
        batch = list(file.execute("SELECT * FROM batches").fetchone())
        done = list(file.execute("SELECT * FROM renders WHERE label = 'done'").fetchone())
        names = [column[1] for column in file.execute("PRAGMA table_info(renders)")]
        file.executescript("DELETE FROM renders; DELETE FROM batches; DELETE FROM render_keys")
        done[names.index("ended_at")] = time.time()
        for number in range(5):
            batch[:2], batch[6] = [number + 1, f"{number:024x}ffffffff"], each
            file.execute(f"INSERT INTO batches VALUES ({', '.join('?' * len(batch))})", batch)
            for step in range(each):
                id = member_id(batch[1], step)
                done[:2], done[-2:] = [number * each + step + 1, id], [number + 1, step]
                file.execute(f"INSERT INTO renders VALUES ({', '.join('?' * len(done))})", done)
                os.link(picture, folder / "renders" / f"{id}.picture")
    picture.unlink()
    with served(tmp_path, SUNBOX_API_KEY="anna", SUNBOX_KEEP_RENDERS="10000") as server:
        server.http.headers.update(frozen.KEY)
        for number in range(5):
            found = server.http.get(f"/v1/batches/{number:024x}ffffffff").raise_for_status().json()
            assert (found["state"], found["counts"]["done"]) == ("done", each)
        assert server.http.get(f"/v1/renders/{id}/image?format=npy").status_code == 200
        assert resident(server.process.pid) < 140e6


def resident(pid: int) -> int:
    """The bytes of a process's own memory, without what it maps of files. Unlike /proc/PID/smaps_rollup, anybody may
    read this at any moment."""
    found = re.search(r"^RssAnon:\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text(), re.MULTILINE)
    assert found is not None
    return int(found[1]) << 10
