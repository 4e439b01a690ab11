"""What slow, silent, hostile and vanished clients do to the others: nothing. A real server, all of them at once."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed

from tests.serving import ENDLESS, SCENE, Client, Server
from tests.serving import client as opened

MOVES = 6
GROWTH = 400 << 20  # bytes: what five clients may make the server hold, their scenes included


def resident(pid: int) -> int:
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * 4096


def silent(client: Client, ended: threading.Event) -> None:
    """Takes nothing from the network, and acknowledges nothing."""
    client.start(settings={**ENDLESS, "width": 512, "height": 512}, view={"format": "rgba32f"})
    ended.wait()


def flooding(client: Client, ended: threading.Event) -> None:
    """Edits as fast as the server takes them, reading nothing."""
    client.start(settings=ENDLESS)
    generation = 1
    while not ended.is_set():
        generation += 1
        client.say("update", generation=generation, settings={"width": 32 + generation % 64})


def babbling(client: Client, ended: threading.Event) -> None:
    """Large messages that are JSON and nothing else."""
    nonsense = json.dumps({"type": "update", "generation": 1, "scene": {"shapes": [SCENE["shapes"][0]] * 8000}})
    while not ended.is_set():
        client.socket.send(nonsense[: 1 << 20])
        client.socket.send("[" * 2000)
        ended.wait(0.1)


def rude(client: Client, ended: threading.Event) -> None:
    """Comes, starts something large, and is gone without a word, over and over."""
    while not ended.wait(0.3):
        with suppress(OSError, ConnectionClosed):
            client.start(settings={**ENDLESS, "width": 1024, "height": 1024})
        vanish(client)
        client = Client(client.url)
    vanish(client)


def vanish(client: Client) -> None:
    with suppress(OSError):
        client.socket.socket.shutdown(socket.SHUT_RDWR)


@pytest.mark.parametrize("behaviours", [(silent, flooding, babbling, rude)])
def test_nobody_is_disturbed(
    server: Server, behaviours: tuple[Callable[[Client, threading.Event], None], ...]
) -> None:
    before = resident(server.process.pid)
    ended = threading.Event()

    def misbehave(behave: Callable[[Client, threading.Event], None]) -> None:
        client = Client(server.url)
        with suppress(ConnectionClosed, OSError, TimeoutError):
            behave(client, ended)
        vanish(client)  # or its endless render would go on beside all later tests

    threads = [threading.Thread(target=misbehave, args=(behave,), daemon=True) for behave in behaviours]
    for thread in threads:
        thread.start()
    try:
        with opened(server) as kind:
            kind.start(settings={**ENDLESS, "width": 128, "height": 128})
            for generation in range(2, MOVES + 2):
                kind.say(
                    "update", generation=generation, scene={"materials": {"ball": {"roughness": generation / 20}}}
                )
                assert kind.frame(generation).generation == generation
            assert resident(server.process.pid) - before < GROWTH
            assert server.http.get("/healthz").status_code == 200
    finally:
        ended.set()
    for thread in threads:
        thread.join(5)
