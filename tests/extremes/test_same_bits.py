"""The same document, settings and seed give the same bits, however the work is cut and whoever asks for it."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gpu import ESTIMATORS, Renderer, RenderSettings
from gpu.picture import tiles as cutting
from gpu.settings import SAMPLERS
from service.cli.program import main
from tests.extremes.scenes import LONG, everything, icosphere, packed
from tests.rendering import document
from tests.serving import Server
from tests.serving import client as opened

CUTS = {  # seconds a slice, seconds a pass, samples a pass at most, seconds between two looks at it, sharers
    "whole": (9.0, 9.0, 256, 600.0, 1),
    "sample by sample": (9.0, 1e-9, 1, 600.0, 1),
    "in small tiles": (1e-6, 9.0, 64, 600.0, 1),
    "stopped after every tile": (1e-5, 1e-2, 3, 0.0, 1),
    "among many": (1e-3, 9.0, 256, 600.0, 1000),
}
SAMPLES = 48


def _bits(gpu: Renderer, cut: str, monkeypatch: pytest.MonkeyPatch, **settings: Any) -> list[np.ndarray]:
    slice_s, pass_s, most, budget, sharers = CUTS[cut]
    for name, value in (("SLICE_S", slice_s), ("PASS_S", pass_s), ("MAX_SAMPLES_A_PASS", most)):
        monkeypatch.setattr(cutting, name, value)
    monkeypatch.setattr("gpu.picture.passes.MAX_SAMPLES_A_PASS", most)
    mesh = icosphere("white", 2, translate=[0, 0.5, 0], scale=0.6)
    loaded = gpu.load(packed(everything(shapes=[everything()["shapes"][0], everything()["shapes"][8], mesh])).arrays)
    defaults = {"width": 40, "height": 24, "max_bounces": 4, "seed": 7}
    made = gpu.picture(loaded, RenderSettings(**{**defaults, **settings}))
    while made.samples < SAMPLES:
        made.trace(budget, SAMPLES, sharers)
    out = [made.read(aov) for aov in ("color", "variance")] + [np.float64(made.noise() or 0)]
    made.release()
    loaded.release()
    return out


MODES = list(itertools.product(ESTIMATORS, SAMPLERS))


@pytest.mark.parametrize(("estimator", "sampler"), MODES if LONG else [("mis", "sobol"), ("uniform", "independent")])
def test_the_cut_never_shows(gpu: Renderer, monkeypatch: pytest.MonkeyPatch, estimator: str, sampler: str) -> None:
    whole = _bits(gpu, "whole", monkeypatch, estimator=estimator, sampler=sampler)
    for cut in CUTS:
        parts = _bits(gpu, cut, monkeypatch, estimator=estimator, sampler=sampler)
        for a, b in zip(whole, parts, strict=True):
            assert np.array_equal(a, b), cut


def test_another_client_does_not_show(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two pictures traced in turns, of scenes with different kernels, as a server does."""
    alone = _bits(gpu, "whole", monkeypatch)
    other = gpu.load(packed(document([], environment={"type": "constant", "radiance": 0.5})).arrays)
    noise = gpu.picture(other, RenderSettings(33, 17))
    trace = type(noise).trace

    def turns(self: Any, budget_s: float, max_samples: int, sharers: int) -> float:
        took = trace(self, budget_s, max_samples, sharers)
        if self is not noise:
            trace(noise, 0.0, noise.samples + 1)
        return took

    monkeypatch.setattr(type(noise), "trace", turns)
    among = _bits(gpu, "stopped after every tile", monkeypatch)
    assert all(np.array_equal(a, b) for a, b in zip(alone, among, strict=True))
    noise.release()
    other.release()


SETTINGS = {"width": 40, "height": 30, "max_samples": 12, "seed": 5, "max_bounces": 4}
SCENE = document(
    [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}, icosphere("m", 1, translate=[1, 1, 0])],
    environment={"type": "constant", "radiance": 0.5},
    lights=[{"type": "point", "position": [2, 2, 2], "intensity": 9}],
)


def test_rest_stream_and_command_line_give_the_same_bits(server: Server, tmp_path: Path) -> None:
    answer = server.http.post("/v1/render", params={"format": "npy"}, json={"scene": SCENE, "settings": SETTINGS})
    assert answer.status_code == 200, answer.text
    (tmp_path / "rest.npy").write_bytes(answer.content)
    (tmp_path / "scene.json").write_text(json.dumps(SCENE))
    options = [word for name, value in SETTINGS.items() for word in ("--set", f"{name}={value}")]
    assert main(["render", str(tmp_path / "scene.json"), "-o", str(tmp_path / "cli.npy"), *options]) == 0
    rest, command_line = (np.load(tmp_path / f"{name}.npy") for name in ("rest", "cli"))
    assert np.array_equal(rest, command_line)
    with opened(server) as client:
        client.start(scene=SCENE, settings=SETTINGS, view={"format": "rgba32f"})
        assert np.array_equal(client.finished()[1].array(), rest)
        client.say("update", generation=2, settings={"seed": 6})
        client.say("pause")
        client.say("resume")
        client.say("update", generation=3, settings={"seed": 5})
        done, frame = client.finished()
        while done["generation"] < 3:
            done, frame = client.finished()
        assert np.array_equal(frame.array(), rest)
