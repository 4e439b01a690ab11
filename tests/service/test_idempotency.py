"""Idempotency-Key on every route that takes one: equal requests at once make one thing."""

from __future__ import annotations

import sqlite3
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier
from typing import Any

import httpx
import pytest

from service.config import Config
from service.problems import Unavailable
from service.server.app import create_app
from service.server.renders.store.batch_rows import BatchOrder, BatchRows
from service.server.renders.store.record import IdempotencyKey
from service.server.renders.store.rows import KEY_S
from service.server.storage.asset_access import NO_USES
from service.server.storage.database import Database
from tests.serving import SCENE, SMALL, Server

BODIES: dict[str, Any] = {
    "/v1/renders": {"scene": SCENE, "settings": SMALL},
    "/v1/batches": {"scene": SCENE, "settings": SMALL, "over": [{"turntable": 1}]},
}
AT_ONCE = 6


def test_every_route_that_takes_a_key_is_known() -> None:
    paths = create_app(Config()).openapi()["paths"]
    operations = ((path, operation) for path, each in paths.items() for operation in each.values())
    taking = {
        path
        for path, operation in operations
        for parameter in operation.get("parameters", ())
        if parameter["name"] == "idempotency-key"
    }
    assert taking == BODIES.keys()


@pytest.mark.parametrize("path", BODIES)
def test_equal_requests_at_once_make_one(server: Server, path: str) -> None:
    together = Barrier(AT_ONCE)

    def sent(_: int) -> httpx.Response:
        with httpx.Client(base_url=server.url, timeout=server.http.timeout) as client:
            client.get("/healthz")  # so that all are connected
            together.wait()
            return client.post(path, json=BODIES[path], headers={"idempotency-key": f"at once {path}"})

    with ThreadPoolExecutor(AT_ONCE) as threads:
        answers = list(threads.map(sent, range(AT_ONCE)))
    assert {each.status_code for each in answers} == {202}, answers[0].text
    assert len({each.json()["id"] for each in answers}) == 1
    other = {**BODIES[path], "label": "another"}
    assert server.http.post(path, json=other, headers={"idempotency-key": f"at once {path}"}).status_code == 409
    long = server.http.post(path, json=BODIES[path], headers={"idempotency-key": "k" * 201})
    assert long.status_code == 422 and long.json()["errors"][0]["pointer"] == "/idempotency-key"


def test_the_database_has_one_batch_of_a_key(tmp_path: Path) -> None:
    rows, key = BatchRows(Database(tmp_path)), IdempotencyKey("k", "digest")

    def insert(id: str, owner: str = "anna") -> int:
        return rows.insert(BatchOrder(id, owner, 1, "[]", created_at=time.time()), b"", NO_USES, key)

    first = insert("a")
    insert("b", "bert")
    with pytest.raises(Unavailable):
        insert("c")
    with sqlite3.connect(Database(tmp_path).path) as database:
        database.execute("UPDATE batches SET created_at = created_at - ? WHERE number = ?", (KEY_S, first))
    assert rows.keyed("anna", "k") is None
    insert("d")
    assert rows.keyed("anna", "k") == ("digest", "d")
