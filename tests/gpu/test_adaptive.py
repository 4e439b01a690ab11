"""Adaptive sampling: what is planned; that nothing of its course shows, its noise is true and no mean is bent."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gpu import Picture, Renderer, RenderSettings
from gpu.layout import PLAN_AREA as AREA
from gpu.layout import PLAN_CLASSES as CLASSES
from gpu.layout.bindings import Slot
from gpu.picture import adaptive
from gpu.picture.noise_meter import FROM
from gpu.picture.sample_plan import DECISIONS, LEAST, MOST, SamplePlan, pixels_of, weights_of
from service.cli.program import main
from tests.gpu.noisy_scenes import SCENES, SHAPES, luminance
from tests.rendering import Images, document, picture
from tests.serving import PATIENCE_S, SCENE, SMALL, Client, Server
from tests.serving import client as opened

RAW = {"format": "rgba32f"}
SIZE: dict[str, Any] = {"width": 44, "height": 37, "max_bounces": 3, "filter": "blackman_harris"}


def counts(made: Picture) -> np.ndarray:
    """(height, width): each pixel's samples."""
    moments = np.frombuffer(made._sums.total[Slot.MOMENTS].read(), np.float32)
    return moments.reshape(made.settings.height, made.settings.width, 4)[..., 3]


@pytest.mark.parametrize("size", [(44, 37), (8, 8), (1, 1), (70, 1), (3, 2)])
def test_each_pixel_has_its_area_and_class(size: tuple[int, int]) -> None:
    pixels = pixels_of(*size)
    assert pixels.sum() == size[0] * size[1] and pixels.shape == (-(-size[1] // 8), -(-size[0] // 8), CLASSES)
    assert pixels.max() <= 16
    assert len(DECISIONS) < CLASSES  # or a class would come to be planned by itself


def test_a_plan_rises_to_its_mean() -> None:
    rng = np.random.default_rng(3)
    pixels = pixels_of(44, 37)
    had = rng.integers(4, 12, pixels.shape).astype(np.uint32)
    plan = SamplePlan(pixels, had, weights_of(rng.random(pixels.shape) ** 8, pixels))
    before = had
    for samples in (8, 9, 11, 20, 21, 64, 500):
        wanted = plan.at(samples)
        assert (wanted >= before).all()
        mean = (wanted * pixels).sum((0, 1)) / pixels.sum((0, 1))
        assert mean == pytest.approx(max(samples, mean.min()), rel=0.05)
        before = wanted
    shares = plan.at(5000) / (5000 * plan.weights)
    assert shares == pytest.approx(np.broadcast_to(shares.mean((0, 1)), shares.shape), rel=0.01)
    assert SamplePlan(pixels).at(7).min() == SamplePlan(pixels).at(7).max() == 7


def test_no_class_is_planned_by_itself() -> None:
    """Nor, over all decisions, by what it had a say in."""
    rng = np.random.default_rng(4)
    pixels = pixels_of(44, 37)
    first, other = rng.random(pixels.shape), rng.random(pixels.shape)
    for own in range(CLASSES):
        changed = first.copy()
        changed[..., own] = other[..., own]
        same = (weights_of(first, pixels) == weights_of(changed, pixels)).all((0, 1))
        assert same.sum() == CLASSES - 1 and not same[(own - 1) % CLASSES]  # only what looks at it


def test_weights_are_bounded_and_know_no_scale() -> None:
    pixels = pixels_of(64, 64)
    variances = np.zeros(pixels.shape)
    assert (weights_of(variances, pixels) == 1).all()
    variances[3, 3] = 16.0
    weights = weights_of(variances, pixels)
    assert weights.min() == np.float32(LEAST) and 8 < weights[3, 3, 0] <= MOST
    assert 1 < weights[3, 4, 0] < weights[3, 3, 0]  # what found light lights its neighbours' way
    assert weights_of(variances * 1e-30, pixels) == pytest.approx(weights)
    assert (weights_of(np.full(pixels.shape, np.inf), pixels) == 1).all()


def test_the_cut_of_the_work_does_not_show(gpu: Renderer) -> None:
    whole, cut = (picture(gpu, SCENES["rough metal"], 1, adaptive=True, **SIZE) for _ in range(2))
    whole.trace(600, 70)
    for stop in (2, 5, 9, 21, 22, 64, 70):
        while cut.samples < stop:
            cut.trace(0.0, stop)
    for aov in ("color", "variance", "albedo"):
        assert np.array_equal(whole.read(aov), cut.read(aov))
    assert whole.noise() == cut.noise()
    taken = counts(whole)
    assert taken.mean() == pytest.approx(70, rel=0.01) and taken.max() > 4 * taken.min() > 0
    for made in (whole, cut):
        made.release()


@pytest.mark.parametrize("decision", DECISIONS[1:])
def test_pixels_get_all_that_a_decision_wants(gpu: Renderer, monkeypatch: pytest.MonkeyPatch, decision: int) -> None:
    """In slices of one sample too, where what an area is short of is not rounded up to a slice."""
    made = picture(gpu, SCENES["cornell"], decision, adaptive=True, **SIZE)
    monkeypatch.setattr(adaptive, "SLICE_S", 1e-12)
    for samples in (decision + 1, decision + 22):
        made.trace(600, samples)
        wanted = made._passes.schedule._read_plan().at(samples)
        y, x = np.mgrid[: SIZE["height"], : SIZE["width"]]
        assert np.array_equal(counts(made), wanted[y // AREA, x // AREA, y % CLASSES])
    made.release()


@pytest.mark.parametrize("samples", [FROM - 1, DECISIONS[1], 50])
def test_saved_in_the_middle_of_a_pass(gpu: Renderer, samples: int) -> None:
    whole = picture(gpu, SCENES["cornell"], 90, adaptive=True, **SIZE)
    half = picture(gpu, SCENES["cornell"], samples, adaptive=True, **SIZE)
    half._passes._begin_pass(samples + 9)
    half._passes._slice()
    steps, state = half.save(), None
    while state is None:
        try:
            next(steps)
        except StopIteration as end:
            state = end.value
    half.release()
    again = gpu.picture(half.scene, half.settings)
    again.restore(state)
    again.trace(600, 90)
    for aov in ("color", "variance"):
        assert np.array_equal(again.read(aov), whole.read(aov))
    assert again.noise() == whole.noise()
    for made in (whole, again):
        made.release()


def test_switched_on_and_off(gpu: Renderer) -> None:
    """Until the first decision both are the same picture; off again, it is the one that it was."""
    made = picture(gpu, SCENES["rough metal"], 40, **SIZE)
    plain = made.read()
    made.configure(RenderSettings(adaptive=True, **SIZE))
    made.trace(600, DECISIONS[0])
    assert (counts(made) == DECISIONS[0]).all()
    made.trace(600, 40)
    assert counts(made).min() < 40 < counts(made).max()
    made.configure(RenderSettings(**SIZE))
    made.trace(600, 40)
    assert np.array_equal(made.read(), plain)
    made.release()


@pytest.mark.parametrize("size", [(1, 1), (3, 2), (70, 1), (9, 3)])
def test_tiny_pictures(gpu: Renderer, size: tuple[int, int]) -> None:
    lit = document(SHAPES, {"ball": {"type": "diffuse", "albedo": 0.5}, "floor": {"type": "diffuse", "albedo": 0.5}},
                   environment={"type": "constant", "radiance": 1})  # fmt: skip
    made = picture(gpu, lit, 1, width=size[0], height=size[1], adaptive=True)
    for samples in (2, FROM, 33, 140):
        made.trace(600, samples)
        noise = made.noise()
        assert made.samples == samples and noise is not None and 0 <= noise < 10
    assert counts(made).mean() == pytest.approx(140, rel=0.05)
    assert np.isfinite(made.read()).all() and (made.display()[..., 3] > 0).any()


def test_a_black_picture(gpu: Renderer) -> None:
    dark = {"ball": {"type": "diffuse", "albedo": 0.5}, "floor": {"type": "diffuse", "albedo": 0.5}}
    made = picture(gpu, document(SHAPES, dark), 40, adaptive=True)
    assert made.noise() == 0 and (counts(made) == 40).all()


@pytest.mark.parametrize(("name", "samplers"), [("cornell", ("sobol", "independent")), ("rough metal", ("sobol",))])
def test_its_noise_is_true_and_less(gpu: Renderer, name: str, samplers: tuple[str, ...]) -> None:
    """Within 20 % of the real error, and below what as many samples of each pixel leave; over four seeds, as of 32
    pictures one is told a third too much: its meter met a path that few find."""
    settings: dict[str, Any] = {"width": 64, "height": 64, "max_bounces": 4, "filter": "blackman_harris"}
    assets: Any = Images()
    halves = [luminance(picture(gpu, SCENES[name], 400, assets, adaptive=True, seed=s, **settings)) for s in (11, 12)]
    reference, doubt = (halves[0] + halves[1]) / 2, ((halves[0] - halves[1]) ** 2).mean() / 4
    for sampler in samplers:
        made = [
            picture(gpu, SCENES[name], 1, assets, sampler=sampler, seed=s, adaptive=adaptive, **settings)
            for adaptive in (True, False)
            for s in (1, 2, 3, 4)
        ]
        for samples in (16, 64):
            squares, said = [], []
            for one in made:
                one.trace(600, samples)
                squares.append(((luminance(one) - reference) ** 2).mean() - doubt)
                said.append(one.noise() or 0.0)
            error = np.sqrt(np.mean(squares[:4])) / reference.mean()
            assert np.mean(said[:4]) == pytest.approx(error, rel=0.2), (sampler, samples)
            assert np.mean(squares[:4]) < 0.7 * np.mean(squares[4:]), (sampler, samples)


def test_no_mean_is_bent(gpu: Renderer) -> None:
    """Where few paths find the light. Planned by their own samples these pictures come out 23 % too dark, z = -8."""
    lamp = {"type": "quad", "origin": [-0.1, 0.6, -0.1], "u": [0.2, 0, 0], "v": [0, 0, 0.2], "material": "lamp"}
    lit = {"floor": {"type": "diffuse", "albedo": 0.7}, "lamp": {"type": "diffuse", "albedo": 0, "emission": 99}}
    scene = document([lamp, {**SHAPES[1], "material": "floor"}], lit)
    size: dict[str, Any] = {"width": 16, "height": 16, "max_bounces": 1, "filter": "box"}
    floor = slice(10, None)  # rows
    truth = luminance(picture(gpu, scene, 1000, estimator="light", **size))[floor].mean()
    made, means = picture(gpu, scene, 1, adaptive=True, **size), []
    for seed in range(150):
        settings = RenderSettings(seed=seed, adaptive=True, estimator="bsdf", sampler="independent", **size)
        made.configure(settings)
        made.trace(600, 40)
        means.append(luminance(made)[floor].mean())
    assert counts(made).max() > 2 * counts(made).min()
    assert abs(np.mean(means) - truth) < 3.5 * np.std(means) / np.sqrt(len(means))


@pytest.fixture
def client(server: Server) -> Iterator[Client]:
    with opened(server) as one:
        yield one


def test_a_render_stops_at_its_noise_and_comes_again(server: Server, tmp_path: Path) -> None:
    """By its mean samples: the picture of that many is the same, to the last bit."""
    settings = {"width": 64, "height": 48, "target_noise": 0.02, "adaptive": True}
    answer = server.http.post("/v1/renders", json={"scene": SCENE, "settings": settings})
    address = f"/v1/{answer.headers['location']}"
    done = server.http.get(address, params={"wait": PATIENCE_S}).json()
    assert done["reason"] == "target_noise" and done["noise"] <= 0.02 and done["settings"]["adaptive"] is True
    png = server.http.get(f"{address}/image").content
    (tmp_path / "a.png").write_bytes(png)
    assert main(["render", str(tmp_path / "a.png"), "-o", str(tmp_path / "b.png")]) == 0
    assert (tmp_path / "b.png").read_bytes() == png


def test_a_stream_takes_it(client: Client) -> None:
    client.start(settings={**SMALL, "max_samples": 40}, view=RAW)
    plain = client.finished()[1].array()
    client.say("update", generation=2, settings={"adaptive": True})
    done, last = client.finished()
    assert done["generation"] == 2 and done["samples"] == 40 and not np.array_equal(last.array(), plain)
    assert last.array().mean() == pytest.approx(plain.mean(), rel=0.02)
    client.say("update", generation=3, settings={"adaptive": "more"})
    assert client.until("error")[0]["problem"]["errors"][0]["pointer"] == "/settings/adaptive"
    client.say("update", generation=4, settings={"adaptive": False})
    assert np.array_equal(client.finished()[1].array(), plain)
