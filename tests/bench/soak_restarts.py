"""Restarts of the whole server while a pipeline's renders wait: nothing may be lost, doubled or left behind.

A pipeline hands in many small renders, each under an idempotency key, and asks again whenever it gets no answer. The
server is killed, alone or with all its processes, or told to end, and started again on the same folder.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from shutil import which
from typing import Any

from tests.bench.server import still_there
from tests.bench.soak_server import SoakServer, add_renderers, renderer_settings

DOCUMENTS = 5  # that differ: the picture of each is known beforehand
SIDE, SAMPLES = 64, 32
LONG_SIDE, LONG_SAMPLES = 512, 1500  # one that is under way at every restart
COMPARED = 40  # pictures
ORPHANS_S = 10.0  # within which the children of a killed server have to end
KILL_EVERY_S = (2.0, 8.0)  # bounds on the life of a renderer, in seconds
BETWEEN = 0.5, 1.5  # times the mean between two restarts
LOOK_S = 5.0  # between two looks at how far the renders are
STUCK_S = 120.0  # without any render that has got further
FULL_BYTES = 48 << 20  # of the file system that is filled


@dataclass
class Outcome:
    """What came of it; the names are those of the table's rows."""

    restarts: int = 0
    kills: int = 0
    accepted: int = 0
    done: int = 0
    compared: int = 0
    checked: int = 0  # ids asked for right after a start
    orphans: int = 0
    starts_s: list[float] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)  # what must not happen
    full_disk: str = "-"
    clock: str = "-"

    @property
    def good(self) -> bool:
        return not self.wrong and not self.orphans and self.done == self.accepted

    def rows(self) -> list[tuple[str, str]]:
        starts = sorted(self.starts_s)
        return [
            ("restarts of the server", str(self.restarts)),
            ("renderers killed", str(self.kills)),
            ("kill to first answer, median / longest (s)", f"{starts[len(starts) // 2]:.1f} / {starts[-1]:.1f}"),
            ("renders accepted / done", f"{self.accepted} / {self.done}"),
            ("ids asked for right after a start", str(self.checked)),
            ("pictures compared bit by bit", str(self.compared)),
            ("processes left behind", str(self.orphans)),
            ("full disk", self.full_disk),
            ("a clock that jumps", self.clock),
            ("lost or wrong", ", ".join(sorted(set(self.wrong))) or "none"),
        ]


def restart(
    folder: Path,
    restarts: int,
    renders: int,
    seconds: float,
    chance: random.Random,
    several: Mapping[str, str] | None = None,
) -> Outcome:
    """`renders` of them, while the server is restarted `restarts` times over about that many seconds. With
    `several`, settings of its renderers, these are killed one by one all the while; pictures are compared with those
    of one renderer."""
    outcome = Outcome()
    settings = {
        "SUNBOX_MAX_JOBS": str(2 * renders + 10),
        "SUNBOX_MAX_QUEUE": str(2 * renders + 10),
        "SUNBOX_KEEP_RENDERS": str(2 * renders + 10),
        "SUNBOX_KEEP_SECONDS": str(24 * 3600),
    }
    data = folder / "data"
    data.mkdir()
    current = [_started(lambda: SoakServer(data, settings))]
    over = threading.Event()
    try:
        expected = [_picture(current[0], number) for number in range(DOCUMENTS)]
        if several:
            settings |= several
            killer = threading.Thread(target=_kill_renderers, args=(current, over, chance, outcome), daemon=True)
            killer.start()
        ids: dict[int, str] = {}
        pipeline = threading.Thread(target=_hand_in, args=(current, renders, ids, outcome), daemon=True)
        pipeline.start()
        for _ in range(restarts):
            time.sleep(chance.uniform(*BETWEEN) * seconds / max(restarts, 1))
            _restart(current, lambda: SoakServer(data, settings), chance, outcome)
            _check(current[0], dict(ids), chance, outcome)
            sys.stderr.write(f"soak: {outcome.restarts} restarts, {len(ids)} renders accepted\n")
        over.set()
        pipeline.join(STUCK_S + renders)
        outcome.accepted = len(ids)
        if pipeline.is_alive():
            outcome.wrong.append("renders that nobody accepted")
        _wait(current[0], ids, outcome)
        _compare(current[0], ids, expected, chance, outcome)
    finally:
        over.set()
        code, left = current[0].stop()
        outcome.orphans += left
        if code:
            outcome.wrong.append(f"exit code {code}")
    return outcome


def _kill_renderers(
    current: list[SoakServer], over: threading.Event, chance: random.Random, outcome: Outcome
) -> None:
    while not over.wait(chance.uniform(*KILL_EVERY_S)):
        if pids := current[0].renderers():
            with suppress(ProcessLookupError):
                os.kill(chance.choice(pids), signal.SIGKILL)
                outcome.kills += 1


def _order(number: int) -> dict[str, Any]:
    scene = {
        "version": 1,
        "camera": {"position": [0, 1, 4], "target": [0, 0.5, 0]},
        "materials": {"m": {"type": "principled", "base_color": [0.8, 0.2 * (number % DOCUMENTS), 0.3]}},
        "shapes": [
            {"type": "sphere", "center": [0, 1, 0], "radius": 1, "material": "m"},
            {"type": "quad", "origin": [-5, 0, -5], "u": [0, 0, 10], "v": [10, 0, 0], "material": "m"},
        ],
        "environment": {"type": "constant", "radiance": 1},
    }
    settings = {"width": SIDE, "height": SIDE, "max_samples": SAMPLES, "seed": number % DOCUMENTS}
    return {"scene": scene, "settings": settings}


def _long() -> dict[str, Any]:
    order = _order(0)
    order["settings"] |= {"width": LONG_SIDE, "height": LONG_SIDE, "max_samples": LONG_SAMPLES}
    return order


def _picture(server: SoakServer, number: int) -> bytes:
    status, body = server.ask("POST", "/v1/render?format=npy", _order(number))
    if status != 200:
        raise RuntimeError(f"the first render was answered with {status}: {body[:500]!r}")
    return body


def _hand_in(current: list[SoakServer], renders: int, ids: dict[int, str], outcome: Outcome) -> None:
    """Ask until each is accepted; an answer that got lost is asked for again under the same key."""
    for number in range(renders + 1):
        order = (_long() if number == 0 else _order(number)) | {"label": "soak"}
        status = 0
        while status != 202:
            status, body = current[0].ask("POST", "/v1/renders", order, {"idempotency-key": f"soak-{number}"})
            if status == 202:
                ids[number] = json.loads(body)["id"]
            elif status in (0, 502, 503):
                time.sleep(0.2)
            else:
                outcome.wrong.append(f"render {status}")
                return


def _restart(
    current: list[SoakServer], start: Callable[[], SoakServer], chance: random.Random, outcome: Outcome
) -> None:
    way = chance.choice(("server", "everything", "sigterm"))
    if way == "sigterm":
        code, left = current[0].stop()
        outcome.orphans += left
        if code:
            outcome.wrong.append(f"exit code {code}")
    else:
        outcome.orphans += still_there(current[0].kill(everything=way == "everything"), ORPHANS_S)
    began = time.monotonic()
    current[0] = _started(start)
    outcome.starts_s.append(time.monotonic() - began)
    outcome.restarts += 1


def _started(start: Callable[[], SoakServer]) -> SoakServer:
    server = start()
    until = time.monotonic() + STUCK_S
    while server.ask("GET", "/healthz")[0] != 200:
        if time.monotonic() > until:
            raise RuntimeError("the server does not answer")
        time.sleep(0.05)
    return server


def _check(server: SoakServer, ids: dict[int, str], chance: random.Random, outcome: Outcome) -> None:
    for number in chance.sample(sorted(ids), min(len(ids), 20)):
        status, _ = server.ask("GET", f"/v1/renders/{ids[number]}")
        outcome.checked += 1
        if status != 200:
            outcome.wrong.append(f"an id answered {status} after a start")


def _listed(server: SoakServer) -> list[dict[str, Any]]:
    """All renders of the pipeline, page by page."""
    found: list[dict[str, Any]] = []
    while True:
        after = f"&after={found[-1]['id']}" if found else ""
        status, body = server.ask("GET", f"/v1/renders?label=soak&limit=200{after}")
        page = json.loads(body) if status == 200 else []
        found += page
        if len(page) < 200:
            return found


def _wait(server: SoakServer, ids: dict[int, str], outcome: Outcome) -> None:
    """Until all have ended, or none gets any further."""
    before, since = -1, time.monotonic()
    while time.monotonic() - since < STUCK_S:
        found = _listed(server)
        ended = [each for each in found if each["state"] not in ("queued", "running")]
        further = sum(each["samples"] for each in found)
        if further > before:
            before, since = further, time.monotonic()
        if len(ended) == len(found):
            break
        sys.stderr.write(f"soak: {len(ended)} of {len(found)} renders ended\n")
        time.sleep(LOOK_S)
    if len(found) != len(ids) or {each["id"] for each in found} != set(ids.values()):
        outcome.wrong.append(f"{len(found)} renders listed")
    wanted = {id: LONG_SAMPLES if number == 0 else SAMPLES for number, id in ids.items()}
    for each in found:
        if each["state"] == "done" and each["samples"] == wanted.get(each["id"]):
            outcome.done += 1
        else:
            outcome.wrong.append(f"a render is {each['state']} with {each['samples']} samples")


def _compare(
    server: SoakServer, ids: dict[int, str], expected: list[bytes], chance: random.Random, outcome: Outcome
) -> None:
    small = sorted(number for number in ids if number)
    for number in chance.sample(small, min(len(small), COMPARED)):
        status, body = server.ask("GET", f"/v1/renders/{ids[number]}/image?format=npy")
        outcome.compared += 1
        if status != 200:
            outcome.wrong.append(f"image {status}")
        elif body != expected[number % DOCUMENTS]:
            outcome.wrong.append("a picture differs from that of a render without restarts")


def fill_disk(folder: Path, outcome: Outcome) -> None:
    """Fill the file system below the data folder, and give the room back. Needs the right to mount one."""
    if os.geteuid() or not which("mount"):
        outcome.full_disk = "not tried, for want of the right to mount a file system"
        return
    small = folder / "small"
    small.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={FULL_BYTES}", "tmpfs", str(small)]
    mounted = subprocess.run(command, capture_output=True)
    if mounted.returncode:
        outcome.full_disk = "not tried, as mounting is not permitted"
        return
    try:
        outcome.full_disk = _filled(small, outcome)
    finally:
        subprocess.run(["umount", "-l", str(small)], capture_output=True)


def _filled(small: Path, outcome: Outcome) -> str:
    server = _started(lambda: SoakServer(small))
    try:
        before = json.loads(server.ask("POST", "/v1/renders", _order(1))[1])["id"]
        server.ask("GET", f"/v1/renders/{before}?wait=60")
        rest = small / "filler"
        with rest.open("wb", buffering=0) as file, suppress(OSError):
            while file.write(bytes(1 << 16)):
                pass
        answers = [server.ask("POST", "/v1/renders", _order(2))[0] for _ in range(3)]
        answers.append(server.ask("PUT", "/v1/documents/scenes/soak", _order(1)["scene"])[0])
        alive = server.ask("GET", "/healthz")[0], server.ask("GET", f"/v1/renders/{before}/image?format=npy")[0]
        rest.unlink()
        time.sleep(1.0)
        after = server.ask("POST", "/v1/renders", _order(3))
        done = json.loads(server.ask("GET", f"/v1/renders/{json.loads(after[1])['id']}?wait=60")[1])
    finally:
        code, left = server.stop()
        outcome.orphans += left
    full = set(answers) <= {503, 507} and alive[0] == 200 and alive[1] in (200, 503)  # a download needs a file, too
    if not full or after[0] != 202 or done["state"] != "done" or code:
        outcome.wrong.append(f"full disk: {answers}, {alive}, {after[0]}, {done['state']}, exit code {code}")
    return f"answered {', '.join(map(str, answers))}; {after[0]} once there was room"


def jump_clock(folder: Path, outcome: Outcome) -> None:
    """Set the server's clock, not the machine's, a day ahead and then two days back. Needs libfaketime."""
    found = sorted(Path("/usr/lib").glob("**/libfaketime.so.1"))
    if not found:
        outcome.clock = "not tried, for want of libfaketime"
        return
    data, offset = folder / "clock", folder / "offset"
    data.mkdir()
    offset.write_text("+0")
    faked = {"LD_PRELOAD": str(found[0]), "FAKETIME_TIMESTAMP_FILE": str(offset), "FAKETIME_NO_CACHE": "1"}
    server = _started(lambda: SoakServer(data, faked | {"FAKETIME_DONT_FAKE_MONOTONIC": "1"}))
    jumps = ("+1d", "-1d", "+0")
    try:
        ids = [json.loads(server.ask("POST", "/v1/renders", _order(1))[1])["id"]]
        server.ask("GET", f"/v1/renders/{ids[0]}?wait=60")
        for number, jump in enumerate(jumps, 2):
            ids.append(json.loads(server.ask("POST", "/v1/renders", _order(number))[1])["id"])
            offset.write_text(jump)
            server.ask("GET", f"/v1/renders/{ids[-1]}?wait=60")
            for id in ids:
                status, body = server.ask("GET", f"/v1/renders/{id}")
                told = json.loads(body)
                if status != 200 or told["state"] != "done" or not 0 <= told["elapsed_s"] < 60:
                    outcome.wrong.append(f"after the clock went {jump}: {status}, {told.get('state')}")
    finally:
        code, left = server.stop()
        outcome.orphans += left
        if code:
            outcome.wrong.append(f"exit code {code}")
    outcome.clock = f"jumped {len(jumps)} times, up to two days"


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--restarts", type=int, default=20)
    parser.add_argument("--renders", type=int, default=1000)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    add_renderers(parser)


def run(arguments: argparse.Namespace) -> int:
    with tempfile.TemporaryDirectory(prefix="sunbox-soak-") as folder:
        seconds = 60 * arguments.minutes
        chance = random.Random(arguments.seed)
        several = renderer_settings(arguments)
        outcome = restart(Path(folder), arguments.restarts, arguments.renders, seconds, chance, several)
        fill_disk(Path(folder), outcome)
        jump_clock(Path(folder), outcome)
    rows = outcome.rows()
    width = max(len(name) for name, _ in rows)
    sys.stdout.write("\n".join(f"{name:<{width}}  {value}" for name, value in rows) + "\n")
    return 0 if outcome.good else 1
