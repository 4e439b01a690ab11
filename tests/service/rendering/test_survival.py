"""The renderer is killed, hangs, is asked for too much: nobody loses anything by it. A real server, real losses."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from tests.serving import ENDLESS, PATIENCE_S, SCENE, SMALL, Picture, Server, wait_until
from tests.serving import client as opened

RAW = {"format": "rgba32f"}
KILLS = int(os.environ.get("SURVIVAL_KILLS", 2))  # in a row; 100 for the record


def kill(server: Server, number: int = signal.SIGKILL) -> int:
    """The process id of the renderer that is no more."""
    pid = server.renderer()
    os.kill(pid, number)
    return pid


def started(server: Server, **settings: Any) -> str:
    body = {"scene": SCENE, "settings": {**SMALL, **settings}}
    return str(server.http.post("/v1/renders", json=body).raise_for_status().json()["id"])


def ended(server: Server, id: str) -> dict[str, Any]:
    told: dict[str, Any] = server.http.get(f"/v1/renders/{id}?wait={PATIENCE_S}").raise_for_status().json()
    return told


def pixels(server: Server, id: str, aov: str = "color") -> bytes:
    return server.http.get(f"/v1/renders/{id}/image?format=npy&aov={aov}").raise_for_status().content


def descriptors(server: Server) -> int:
    """Of the server, which only root could count from outside."""
    lines = server.http.get("/metrics").text.splitlines()
    return next(int(float(line.split()[1])) for line in lines if line.startswith("process_open_fds "))


def test_nobody_loses_anything_by_a_kill(mortal: Server) -> None:
    """The stream goes on in its generation, a render under way comes out the same, a finished one stays readable."""
    finished = started(mortal)
    assert ended(mortal, finished)["state"] == "done"
    before = {aov: pixels(mortal, finished, aov) for aov in ("color", "variance", "normal")}
    with opened(mortal) as stream:
        stream.start(settings=ENDLESS, view=RAW)
        frames = [stream.frame() for _ in range(3)]
        running = started(mortal, width=256, height=256, max_samples=40, seed=3)
        kill(mortal)
        again = stream.frame()
        while again.samples >= frames[-1].samples:  # what was still on its way
            frames.append(again)
            again = stream.frame()
        assert again.generation == 1 and again.seq == frames[-1].seq + 1
        stream.say("update", generation=2, scene={"materials": {"ball": {"roughness": 0.9}}})
        assert stream.frame(generation=2).generation == 2
    assert ended(mortal, running)["state"] == "done"
    assert {aov: pixels(mortal, finished, aov) for aov in before} == before
    undisturbed = started(mortal, width=256, height=256, max_samples=40, seed=3)
    assert ended(mortal, undisturbed)["state"] == "done"
    assert pixels(mortal, undisturbed) == pixels(mortal, running)


def test_kills_in_a_row_leave_nothing_behind(mortal: Server) -> None:
    with opened(mortal) as stream:
        stream.start(settings=ENDLESS)
        stream.frame()
        job = started(mortal, width=128, height=128, max_samples=1 << 24)
        wait_until(lambda: mortal.http.get(f"/v1/renders/{job}").json()["samples"] > 0)
        held = None
        for n in range(KILLS):
            pid = kill(mortal, signal.SIGTERM if n == 1 else signal.SIGKILL)
            wait_until(lambda pid=pid: mortal.renderer() != pid)
            kept = stream.frame()
            wait_until(lambda: mortal.http.get(f"/v1/renders/{job}").json()["samples"] > 0)
            assert kept.generation == 1 and not Path(f"/proc/{pid}").exists()
            held = held or descriptors(mortal)  # after the first: one renderer's worth, as ever
        assert mortal.http.get(f"/v1/renders/{job}").json()["state"] == "running"
        assert descriptors(mortal) <= held + 1
        assert mortal.http.delete(f"/v1/renders/{job}").status_code == 204


def test_a_renderer_that_hangs_is_replaced(mortal: Server) -> None:
    with opened(mortal) as stream:
        stream.start(settings=ENDLESS)
        samples = stream.frame().samples
        pid = kill(mortal, signal.SIGSTOP)
        wait_until(lambda: mortal.renderer() != pid)
        wait_until(lambda: stream.frame().samples != samples)
        assert not Path(f"/proc/{pid}").exists()


def test_too_much_falls_back_to_what_was_there(mortal: Server) -> None:
    with opened(mortal) as stream:
        stream.start(settings=SMALL, view=RAW)
        before = stream.finished()[1]
        stream.say("update", generation=2, settings={"width": 4000, "height": 4000})
        error, _ = stream.until("error")
        assert error["generation"] == 2 and error["problem"]["status"] == 422
        assert "MiB" in error["problem"]["detail"] and "SUNBOX_GPU_MEMORY" in error["problem"]["detail"]
        stream.say("view", exposure=0)
        kept = stream.frame()
        assert kept.generation == 1 and kept.samples == before.samples
        assert np.array_equal(kept.array(), before.array())
        stream.say("update", generation=3, scene={"materials": {"ball": {"roughness": 0.9}}})
        done, last = stream.finished()
        assert done["generation"] == 3 and (last.width, last.height) == (32, 24)
    refused = started(mortal, width=4000, height=4000)
    failed = ended(mortal, refused)
    assert failed["state"] == "failed" and "MiB" in failed["problem"]["detail"]


def test_who_rests_makes_room(mortal: Server) -> None:
    """Four pictures of 24 MB where two fit: each comes back as it was when somebody looks at it."""
    ids = [started(mortal, width=500, height=500, max_samples=1) for _ in range(2)]
    jobs = {id: pixels(mortal, id) for id in ids if ended(mortal, id)["state"] == "done"}
    with opened(mortal) as one, opened(mortal) as other:
        shown: list[Picture] = []
        for stream in (one, other):
            stream.start(settings={**SMALL, "width": 500, "height": 500, "max_samples": 2}, view=RAW)
            shown.append(stream.finished()[1])
        assert len(jobs) == 2 and {id: pixels(mortal, id) for id in jobs} == jobs
        for stream, before in zip((one, other), shown, strict=True):
            stream.say("view", exposure=0)
            frame = stream.frame()
            assert frame.samples == before.samples and np.array_equal(frame.array(), before.array())
    assert mortal.http.get("/healthz").status_code == 200


def test_a_server_that_is_told_again_ends_at_once(tmp_path: Path) -> None:
    """At a signal that comes a second after the first."""
    program = (
        "import time; from service.server import app\n"
        "server = app._Server(app.uvicorn.Config(None), None)\n"
        "server._end(); server._end(); print('told', flush=True)\n"
        "time.sleep(app.AGAIN_S + 0.1); server._end(); print('went on')\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=30)
    assert (done.stdout, done.returncode) == ("told\n", 0), done.stderr
