"""What callers see of divided pictures: a server with two renderers, asked over HTTP and by stream."""

from __future__ import annotations

import re
import time

import numpy as np
import pytest

from tests.serving import PATIENCE_S, SCENE, Client, Server

SETTINGS = {"width": 96, "height": 80, "max_samples": 200, "seed": 9}


def _leases(server: Server) -> float:
    found = re.findall(r'^sunbox_leases_total\{outcome="done".*\} (.*)$', server.http.get("/metrics").text, re.M)
    return sum(map(float, found))


def test_a_render_is_divided_and_says_so(two: Server, server: Server) -> None:
    ask = {"scene": SCENE, "settings": SETTINGS}
    id, before = two.http.post("/v1/renders", json=ask).json()["id"], _leases(two)
    status, seen = {"state": "queued"}, set()
    while status["state"] in ("queued", "running"):
        status = two.http.get(f"/v1/renders/{id}").json()
        seen.add(status["renderers"])
    assert status["state"] == "done" and status["samples"] == 200 and status["not_divided"] is None
    assert 2 in seen and status["renderers"] == 0 and _leases(two) > before
    for aov in ("color", "variance", "normal"):
        query = {"format": "npy", "aov": aov}
        divided = two.http.get(f"/v1/renders/{id}/image", params=query).content
        whole = server.http.post("/v1/render", params=query, json=ask).content
        assert divided == whole, aov


@pytest.mark.parametrize(("setting", "value"), [("adaptive", True), ("time_limit", 60)])
def test_what_is_not_divided_names_the_setting(two: Server, setting: str, value: object) -> None:
    ask = {"scene": SCENE, "settings": {**SETTINGS, setting: value}}
    before = _leases(two)
    id = two.http.post("/v1/renders", json=ask).json()["id"]
    status = two.http.get(f"/v1/renders/{id}", params={"wait": PATIENCE_S}).json()
    assert status["state"] == "done" and f"settings.{setting}" in status["not_divided"]
    assert _leases(two) == before


def test_a_stream_has_as_many_as_it_asks_for(two: Server) -> None:
    endless = {"width": 96, "height": 80, "max_samples": 1 << 20}
    with Client(two.url) as stream:
        before = _leases(two)
        stream.start(settings=endless)
        while stream.frame().samples < 256:
            pass
        assert _leases(two) == before, "it did not ask for another one"
        stream.start(generation=2, settings=endless, renderers=7)
        until = time.monotonic() + PATIENCE_S
        samples = 0
        while _leases(two) == before:
            frame = stream.frame()
            assert time.monotonic() < until
            assert frame.generation == 1 or frame.samples >= samples
            samples = frame.samples if frame.generation == 2 and frame.scale == 1 else 0
        stream.say("start", generation=3, scene=SCENE, settings=endless, renderers=0)
        problem = stream.until("error")[0]["problem"]
        assert problem["status"] == 422 and problem["errors"][0]["pointer"] == "/renderers"
        assert np.isfinite(stream.frame().samples)
