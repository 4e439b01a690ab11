"""The view's `denoise`: for the eye alone, from the first sample on, and until there is no noise to be seen."""

from __future__ import annotations

import io
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from PIL import Image

from service.ipc.messages import Progress, View
from service.worker.helpers.denoise_client import DenoiseClient, DenoiseRequest, DenoiseResult
from service.worker.view.denoise_policy import DenoisePolicy
from tests.serving import PATIENCE_S, SCENE, Client, Picture, Server
from tests.serving import client as opened

FEW = {"width": 96, "height": 64, "max_samples": 4, "max_bounces": 4}
EYE = {"format": "png", "denoise": True}


@pytest.fixture
def client(server: Server) -> Iterator[Client]:
    with opened(server) as connected:
        yield connected


def displayed(data: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"), np.float64)


def rest(server: Server, **settings: Any) -> np.ndarray:
    body = {"scene": SCENE, "settings": {**FEW, **settings}}
    return displayed(server.http.post("/v1/render", json=body, params={"format": "png"}).content)


def error(picture: np.ndarray, reference: np.ndarray) -> float:
    return float(np.sqrt(np.mean((picture - reference) ** 2)))


def last_of(client: Client, **view: Any) -> tuple[dict[str, Any], Picture]:
    client.start(settings=FEW, view=view)
    done, last = client.finished()
    return done, last


def test_it_is_seen_and_not_kept(server: Server, client: Client) -> None:
    done, last = last_of(client, **EYE)
    assert last.header["denoised"] is True and last.noise == done["noise"] > 0.03
    plain, reference = rest(server), rest(server, max_samples=400, seed=3)
    assert error(displayed(last.image), reference) < 0.6 * error(plain, reference)
    client.say("view", denoise=False)
    kept = client.frame()
    assert "denoised" not in kept.header and np.array_equal(displayed(kept.image), plain)
    for format in ("rgba32f", "png"):
        client.say("view", format=format, denoise=True)
        assert client.frame().header.get("denoised", False) is (format == "png")


def test_other_layers_are_as_they_were_traced(client: Client) -> None:
    assert "denoised" not in last_of(client, **EYE, aov="normal")[1].header


def test_a_small_first_look_is_denoised_too(client: Client) -> None:
    """Where nothing can be guessed at; but not while the denoiser has another picture in hand."""
    slow = {"width": 640, "height": 480, "max_samples": 1 << 20, "max_bounces": 64, "estimator": "uniform"}
    room = {"type": "sphere", "center": [0, 0, 0], "radius": 20, "material": "ball"}
    client.start(scene={**SCENE, "shapes": [*SCENE["shapes"], room]}, settings=slow, view=EYE)
    generation, until, frame = 1, time.monotonic() + PATIENCE_S, client.frame()
    while not (frame.scale < 1.0 and frame.header.get("denoised")):
        assert time.monotonic() < until
        if frame.scale == 1.0:  # there is no small one here, or not any more
            generation += 1
            client.say("update", generation=generation, settings={"seed": generation})
        frame = client.frame(generation)
    assert frame.noise is None and frame.samples == 1


class Aside(DenoiseClient):
    """A denoiser that makes every picture white."""

    busy = late = False
    started = False
    missing = None

    def __init__(self) -> None:
        pass

    def start(self) -> None:
        self.started = True

    def ask(self, order: DenoiseRequest, told: Callable[[DenoiseResult], None]) -> None:
        told(DenoiseResult(np.ones_like(order.color)))


class Black:
    def read(self) -> np.ndarray:
        return np.zeros((2, 2, 4), np.float32)

    def guides(self, most: int) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros((2, 2, 3), np.float32), np.zeros((2, 2, 3), np.float32)


def shown(policy: DenoisePolicy, noise: float | None, scale: float = 1.0) -> float:
    """How white what is shown of a black picture is."""
    black: Any = Black()
    policy.begin(black, Progress(3, noise), fine=False, on_done=lambda: None, scale=scale)
    assert policy.latest is not None and policy.latest.scale == scale
    assert np.ptp(policy.latest.pixels) == 0
    return float(policy.latest.pixels[0, 0, 0])


def test_it_fades_as_the_noise_falls() -> None:
    policy = DenoisePolicy(denoiser := Aside(), yields=True)
    assert not policy.covers("color", None)
    policy.set_view(View(denoise=True))
    assert denoiser.started and policy.covers("color", None) and policy.covers("color", 0.016)
    assert not policy.covers("color", 0.014) and not policy.covers("color", None, final=True)
    assert [shown(policy, noise) for noise in (None, 0.5, 0.03)] == [1.0, 1.0, 1.0]
    assert shown(policy, 0.0225) == pytest.approx(0.5) and shown(policy, 0.015) == 0.0


def test_the_setting_has_it_whole_and_begins_anew() -> None:
    policy = DenoisePolicy(Aside(), yields=True)
    policy.set_view(View(denoise=True))
    assert shown(policy, 0.0225) == pytest.approx(0.5)
    policy.want(True)
    assert policy.latest is None and policy.covers("color", 0.006, final=True)
    assert shown(policy, 0.0225) == 1.0


def test_a_larger_picture_is_due_at_once() -> None:
    policy = DenoisePolicy(Aside(), yields=True)
    policy.set_view(View(denoise=True))
    shown(policy, None, scale=0.25)
    assert policy.has(3) is None and not policy.due(3, fine=False, scale=0.25) and policy.due(1, fine=False)
