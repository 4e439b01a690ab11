"""A short form of the drag session that `make soak` holds for an hour."""

from __future__ import annotations

import os
import random
import signal
import threading
from pathlib import Path

import pytest

from gpu import Renderer
from tests.bench import soak_page
from tests.bench.soak_server import SoakServer, resident
from tests.bench.soak_tally import Tally

SECONDS = 4.0


@pytest.mark.calm  # it counts what a hand gets done
def test_a_drag_session_survives_a_renderer_and_keeps_its_memory(
    gpu: Renderer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if lacking := soak_page.missing():
        (pytest.fail if os.environ.get("CI") else pytest.skip)(f"no {lacking}")
    monkeypatch.setattr(soak_page, "WEIGH_S", 0.5)
    monkeypatch.setattr(soak_page, "SETTLED_S", 1.0)
    server, tally, over = SoakServer(tmp_path), Tally(), threading.Event()
    try:
        session = threading.Thread(target=soak_page.drag, args=(server, tally, over, random.Random(1)))
        session.start()
        over.wait(SECONDS / 2)
        (renderer,) = server.renderers()
        os.kill(renderer, signal.SIGKILL)
        over.wait(SECONDS / 2)
        while session.is_alive() and tally.drags < 4:
            session.join(0.1)
        over.set()
        session.join(60)
        tally.seen(resident(server.pid), 1, 1, settled=True)
    finally:
        code, orphans = server.stop()
    assert not session.is_alive() and not tally.lost and tally.drags >= 4
    assert (code, orphans) == (0, 0)
    assert tally.good(growth=1.5, fair=0.95, page_growth=1.5), tally.table()
    heap = next(row for row in tally.table().splitlines() if "heap" in row).split("  ")[-1]
    assert all(1 < float(mib) < 64 for mib in heap.split(" / ")), heap
