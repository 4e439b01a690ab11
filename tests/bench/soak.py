"""Mixed clients for a long time while renderers are killed: `python -m tests.bench soak --minutes 60`.

It prints a table of the results. The exit code is 1 when anything was lost, leaked or unfair.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

from tests.bench import soak_clients as clients
from tests.bench import soak_page
from tests.bench.soak_server import SoakServer, add_renderers, descriptors, largest, renderer_settings, resident
from tests.bench.soak_tally import Tally

STREAMS, RENDERS = 4, 2
KILL_EVERY_S = (3.0, 12.0)  # bounds on the life of a renderer, in seconds
WATCH_S = 2.0
STUCK_S = 60.0  # for a client to come to its end after the last kill, or for a render to get any further
SETTLED_S = 20.0  # after which memory is compared with what it is at the end
GROWTH = 1.5  # ... times that, and no more
PAGE_GROWTH = 1.25  # of the page's heap; its undo fills up to its depth in the first minutes
FAIR = 0.95


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    add_renderers(parser)


def run(arguments: argparse.Namespace) -> int:
    with tempfile.TemporaryDirectory(prefix="sunbox-soak-") as folder:
        tally = Tally()
        server = SoakServer(Path(folder), renderer_settings(arguments))
        try:
            _run(server, tally, 60.0 * arguments.minutes, random.Random(arguments.seed))
            tally.jain = clients.share_alike(server, tally)
            tally.end(server)
        finally:
            tally.exit_code, tally.orphans = server.stop()
    print(tally.table())
    return 0 if tally.good(GROWTH, FAIR, PAGE_GROWTH) else 1


def _run(server: SoakServer, tally: Tally, seconds: float, chance: random.Random) -> None:
    """Run all clients at once, until the time is over."""
    over = threading.Event()
    acts: list[Callable[[SoakServer, Tally, threading.Event, random.Random], None]] = [
        *[clients.drag] * STREAMS,
        *[clients.render] * RENDERS,
        clients.upload,
        clients.cancel,
        clients.vanish,
        _kill,
        _watch,
    ]
    if lacking := soak_page.missing():
        sys.stderr.write(f"soak: nobody drags in a browser, for want of {lacking}\n")
    else:
        acts.append(soak_page.drag)
    threads = [
        threading.Thread(target=act, args=(server, tally, over, random.Random(chance.random())), daemon=True)
        for act in acts
    ]
    for thread in threads:
        thread.start()
    until = time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        time.sleep(min(left, 30.0))
        sys.stderr.write(f"soak: {left / 60:.1f} min left, {tally.kills} kills, {tally.frames} frames\n")
    over.set()
    ended = time.monotonic()
    for thread in threads:
        while thread.is_alive() and tally.still_s(thread.ident, ended) < STUCK_S:
            thread.join(1.0)
        tally.stuck += thread.is_alive()


def _kill(server: SoakServer, tally: Tally, over: threading.Event, chance: random.Random) -> None:
    while not over.wait(chance.uniform(*KILL_EVERY_S)):
        pids = server.renderers()
        if pids:
            os.kill(chance.choice(pids), signal.SIGKILL)
            tally.kill()


def _watch(server: SoakServer, tally: Tally, over: threading.Event, chance: random.Random) -> None:
    """Record memory and descriptors until the end."""
    began = time.monotonic()
    while not over.wait(WATCH_S):
        settled = time.monotonic() - began > SETTLED_S
        tally.seen(resident(server.pid), largest(server.renderers()), descriptors(server), settled)
