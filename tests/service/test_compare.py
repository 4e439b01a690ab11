"""`POST /v1/compare`, as a client meets it: verdicts, maps, refusals, and what it leaves alone."""

from __future__ import annotations

import asyncio
import copy
import io
import json
from concurrent.futures import ThreadPoolExecutor
from http.client import HTTPConnection
from typing import Any

import httpx
import numpy as np
import pytest
from PIL import Image

from service.ipc.messages import Progress, View
from service.server.routes.compare import _estimate
from service.server.verdict.evidence import Estimate
from service.server.verdict.figures import displayed
from service.worker.view.frames import pixels_of
from tests.calls import is_problem, metrics, pixels, start, status
from tests.serving import Server, wait_until

# Of the features of `serving.SCENE`, so that both have one kernel.
BALL: dict[str, Any] = {
    "version": 1,
    "camera": {"position": [0, 0, 3.2], "target": [0, 0, 0]},
    "environment": {"type": "constant", "radiance": 0.3},
    "lights": [{"type": "point", "position": [3, 4, 4], "intensity": 80}],
    "materials": {
        "ball": {"type": "disney", "base_color": [0.8, 0.3, 0.2], "roughness": 0.3},
        "floor": {"type": "diffuse", "albedo": 0.6},
    },
    "shapes": [
        {"type": "sphere", "center": [0, 0, 0], "radius": 0.7, "material": "ball"},
        {"type": "quad", "origin": [-5, -1, 5], "u": [10, 0, 0], "v": [0, 0, -10], "material": "floor"},
    ],
}
LEVEL = 0.05


@pytest.fixture
def http(server: Server) -> httpx.Client:
    return server.http


def document(scene: Any = BALL, size: int = 32, samples: int = 64, **settings: Any) -> dict[str, Any]:
    return {"scene": scene, "settings": {"width": size, "height": size, "max_samples": samples, **settings}}


def changed(pointer: str, value: Any) -> Any:
    scene = copy.deepcopy(BALL)
    *steps, last = pointer.split("/")[1:]
    at: Any = scene
    for step in steps:
        at = at[int(step)] if isinstance(at, list) else at[step]
    at[int(last) if isinstance(at, list) else last] = value
    return scene


def compare(http: httpx.Client, a: Any, b: Any, **more: Any) -> Any:
    answer = http.post("/v1/compare", json={"a": a, "b": b, **more})
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert found["different"] == (found["p_value"] < 1 - more.get("confidence", 0.999))
    assert found["different"] == bool(found["regions"])
    return found


def ended(http: httpx.Client, scene: Any = BALL, **settings: Any) -> str:
    """The id of a render that has ended."""
    id = str(start(http, document(scene, **settings)["settings"], scene)["id"])
    assert status(http, id, wait=60)["state"] == "done"
    return id


def exr(http: httpx.Client, id: str, aov: str = "all") -> str:
    """The id of the asset that a render's file becomes."""
    file = http.get(f"/v1/renders/{id}/image", params={"format": "exr", "aov": aov}).content
    answer = http.post("/v1/assets", content=file, headers={"content-type": "application/octet-stream"})
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def test_a_document_and_itself_are_the_same(http: httpx.Client) -> None:
    """Whatever their seeds are."""
    found = compare(http, document(seed=1), document(seed=2))
    assert found == {
        "different": False, "p_value": 1.0, "mean_difference": 0.0, "rmse": 0.0, "psnr": None, "flip": 0.0,
        "ssim": 1.0, "differing": {"share": 0.0, "difference": 0.0}, "samples": {"a": 0, "b": 0}, "regions": [],
    }  # fmt: skip


def test_documents_that_say_the_same_have_equal_bits(http: httpx.Client) -> None:
    """All samples are taken, as nothing else would tell."""
    scene = changed("/materials", {"other": BALL["materials"]["ball"], "floor": BALL["materials"]["floor"]})
    scene["shapes"][0]["material"] = "other"
    found = compare(http, document(seed=1), document(scene, seed=2))
    assert (found["different"], found["p_value"], found["psnr"]) == (False, 1.0, None)
    assert found["samples"] == {"a": 64, "b": 64}


def test_another_roughness_is_found_at_once_where_it_is(http: httpx.Client) -> None:
    found = compare(http, document(samples=1024), document(changed("/materials/ball/roughness", 0.6), samples=1024))
    assert found["different"] and found["samples"]["a"] == found["samples"]["b"] < 1024
    ball = pixels(http, ended(http, samples=1), "shape_id")[..., 0] == 1
    rows, columns = np.nonzero(ball)
    for each in found["regions"]:
        assert columns.min() - 2 <= each["x"] and each["x"] + each["width"] <= columns.max() + 3
        assert rows.min() - 2 <= each["y"] and each["p_value"] >= found["p_value"]
    assert found["rmse"] > 0 and found["flip"] > 0 and found["ssim"] < 1 and found["psnr"] < 60
    assert 0 < found["differing"]["share"] <= ball.mean() and 0 < found["differing"]["difference"] < 0.5


def test_roughness_of_30_and_305_hundredths_is_found(http: httpx.Client) -> None:
    sides = [document(changed("/materials/ball/roughness", value), 64, 512) for value in (0.3, 0.305)]
    assert compare(http, *sides)["different"]


@pytest.mark.parametrize("factor", [0.995, 1.005])
def test_a_mean_shift_is_not_taken_for_noise(http: httpx.Client, factor: float) -> None:
    brighter = changed("/environment/radiance", 0.3 * factor)
    brighter["lights"][0]["intensity"] = 80 * factor
    found = compare(http, document(samples=64), document(brighter, samples=64))
    assert found["different"] and np.sign(found["mean_difference"]) == np.sign(factor - 1)


@pytest.mark.slow
def test_other_ways_to_the_same_light_do_not_differ(http: httpx.Client) -> None:
    scene = changed("/lights", [])
    scene["shapes"].append(
        {"type": "quad", "origin": [-1, 2, -1], "u": [2, 0, 0], "v": [0, 0, 2], "material": "lamp"}
    )
    scene["materials"]["lamp"] = {"type": "diffuse", "albedo": 0, "emission": 5}
    scene["materials"]["ball"] = {"type": "diffuse", "albedo": 0.5}
    for other in ({"estimator": "bsdf"}, {"sampler": "independent"}, {"filter": "blackman_harris", "seed": 9}):
        assert not compare(http, document(scene), document(scene, **other))["different"], other
    del scene["environment"]  # the lamp alone is seldom found without looking for it
    first, second = (ended(http, scene, estimator=each) for each in ("mis", "bsdf"))
    for b in (document(scene, estimator="bsdf"), second):
        assert not compare(http, first, b)["different"]
    assert not compare(http, exr(http, first), second)["different"]
    assert not compare(http, document(scene), document(scene, estimator="bsdf"))["different"]


@pytest.mark.slow
def test_renders_of_other_seeds_do_not_differ_and_stay_as_they_are(http: httpx.Client) -> None:
    """Twenty pairs, of which one alarms at a level of 0.05."""
    ids = [ended(http, size=16, samples=8, seed=seed) for seed in range(40)]
    p = [compare(http, a, b, confidence=1 - LEVEL)["p_value"] for a, b in zip(ids[::2], ids[1::2], strict=True)]
    assert sum(each < LEVEL for each in p) <= 5  # more come once in a thousand
    assert status(http, ids[0])["samples"] == 8
    other = ended(http, changed("/materials/ball/base_color", [0.2, 0.6, 0.8]), size=16, samples=8)
    assert compare(http, ids[0], other)["different"]
    for id in [*ids, other]:
        http.delete(f"/v1/renders/{id}")


def test_a_document_beside_a_render_begins_as_that_was_made(http: httpx.Client) -> None:
    """So that a document that did not change has its bits, and one that did needs few samples."""
    id = ended(http, samples=32, seed=5)
    same = compare(http, id, document(samples=32, seed=6))
    assert (same["p_value"], same["samples"]) == (1.0, {"a": 32, "b": 32})
    more = compare(http, document(samples=128), id)
    assert not more["different"] and more["samples"] == {"a": 128, "b": 32}
    darker = document(changed("/environment/radiance", 0.297), samples=32)
    assert compare(http, id, darker)["different"]


def test_exr_files_are_compared(http: httpx.Client) -> None:
    first, second = ended(http), ended(http, changed("/materials/ball/roughness", 0.8))
    asset = exr(http, first)
    same = compare(http, asset, first)
    assert (same["p_value"], same["rmse"], same["samples"]) == (1.0, 0.0, {"a": 64, "b": 64})
    assert compare(http, second, asset)["different"]
    assert compare(http, asset, document())["p_value"] == 1.0

    def refused(id: str, code: int) -> Any:
        answer = http.post("/v1/compare", json={"a": first, "b": id})
        assert is_problem(answer, code, "/b")
        return answer.json()["errors"][0]["detail"]

    assert "aov=all" in refused(exr(http, first, "color"), 422)
    png = http.get(f"/v1/renders/{first}/image").content
    image = http.post("/v1/assets", content=png, headers={"content-type": "image/png"}).json()["id"]
    assert "no EXR" in refused(image, 422)
    refused("sha256:" + "0" * 64, 404)
    refused("0" * 32, 404)
    refused("", 404)


def test_colour_and_variance_of_a_render_that_goes_on_have_the_same_samples() -> None:
    """They are read at once: of a quick render two readings might never have the same."""

    class Quick:
        samples = 0

        async def image(self, view: View) -> tuple[np.ndarray, Progress]:
            self.samples += 1
            return pixels_of(self, view, None), Progress(self.samples)  # type: ignore[arg-type]

        def read(self, aov: str) -> np.ndarray:
            channels = {"color": 4, "variance": 3}[aov]
            return np.full((2, 3, channels), self.samples + (aov == "variance"), np.float32)

    estimate = asyncio.run(asyncio.wait_for(_estimate(Quick()), 10))  # type: ignore[arg-type]
    expected = Estimate.of(np.ones((2, 3, 4), np.float32), np.full((2, 3, 3), 2, np.float32), 1)
    for name, value in vars(expected).items():
        assert np.array_equal(vars(estimate)[name], value), name


@pytest.mark.parametrize("map", ["p", "difference", "flip", "heat"])
def test_maps_are_pictures_with_the_verdict_beside_them(http: httpx.Client, map: str) -> None:
    body = {"a": document(samples=16), "b": document(changed("/materials/ball/base_color", 0.1), samples=16)}
    answer = http.post("/v1/compare", json=body, params={"format": "png", "map": map})
    assert answer.status_code == 200 and answer.headers["content-type"] == "image/png"
    shown = np.asarray(Image.open(io.BytesIO(answer.content)))
    assert shown.shape == (32, 32, 3)
    ball, corner = shown[10:22, 10:22].astype(int), shown[:3, :3].astype(int)
    if map == "difference":
        assert (corner == 128).all() and ball.min() < 60
    else:
        assert corner.max() <= 8 and ball.mean() > 60
    assert json.loads(answer.headers["sunbox-verdict"])["different"]


def test_pictures_are_judged_as_they_are_displayed(http: httpx.Client) -> None:
    id = ended(http, changed("/lights/0/intensity", 800))  # with highlights beyond white
    shown = np.asarray(Image.open(io.BytesIO(http.get(f"/v1/renders/{id}/image").content)).convert("RGB"))
    assert np.abs(255 * displayed(pixels(http, id)[..., :3].astype(float)) - shown).max() < 0.6


@pytest.mark.parametrize(
    ("body", "pointers"),
    [
        ({"a": document(), "b": document(size=16)}, ["/b"]),
        ({"a": document(), "b": document(), "confidence": 1}, ["/confidence"]),
        ({"a": document(), "b": document(), "confidence": 0}, ["/confidence"]),
        ({"a": document(), "b": document(), "confidence": "0.9"}, ["/confidence"]),
        ({"a": document()}, ["/b"]),
        ({"a": document(), "b": 5}, ["/b"]),
        ({"a": document(), "b": document(), "c": 1}, ["/c"]),
        ({"a": {"settings": {}}, "b": {"scene": BALL, "extra": 1}}, ["/a/scene", "/b/extra"]),
        (
            {"a": document(changed("/camera/vfov", 200)), "b": document(samples=0)},
            ["/a/scene/camera/vfov", "/b/settings/max_samples"],
        ),
        (
            {"a": document(), "b": document(changed("/shapes/0", {"type": "mesh", "asset": "sha256:" + "0" * 64,
             "material": "ball"}))},
            ["/b/scene/shapes/0/asset"],
        ),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(http: httpx.Client, body: Any, pointers: list[str]) -> None:
    assert is_problem(http.post("/v1/compare", json=body), 422, *pointers)


def test_what_cannot_be_compared_is_refused(http: httpx.Client) -> None:
    large = document(size=4000, samples=1)
    assert is_problem(http.post("/v1/compare", json={"a": large, "b": large}), 422, "/a")
    assert http.post("/v1/compare", json={"a": "", "b": ""}, params={"map": "x"}).status_code == 422
    denoised = str(start(http, document(samples=4, denoise=True)["settings"], BALL)["id"])
    status(http, denoised, wait=60)
    answer = http.post("/v1/compare", json={"a": denoised, "b": denoised})
    assert is_problem(answer, 422, "/a") and "denoise" in answer.json()["errors"][0]["detail"]


def test_denoising_and_adaptive_samples_are_left_out_of_documents(http: httpx.Client) -> None:
    found = compare(http, document(samples=16), document(samples=16, denoise=True, adaptive=True))
    assert found["p_value"] == 1.0 and found["rmse"] == 0


def test_a_time_limit_ends_it(http: httpx.Client) -> None:
    """Of no samples' number: a comparison of equal noise would go on to 2^24 samples."""
    a, b = (document(samples=2**24, time_limit=0.2, roulette_depth=each) for each in (1, 3))
    assert compare(http, a, b)["samples"]["a"] < 2**20


def test_how_far_a_comparison_is_can_be_asked(server: Server) -> None:
    sides = [document(samples=256, size=64, roulette_depth=each) for each in (1, 3)]
    assert server.http.get("/v1/compare/mine").status_code == 204
    with ThreadPoolExecutor(1) as pool:
        body = {"a": sides[0], "b": sides[1]}
        answer = pool.submit(httpx.post, f"{server.url}/v1/compare", params={"name": "mine"}, json=body, timeout=120)
        told = set[tuple[int, int]]()
        while not answer.done():
            found = server.http.get("/v1/compare/mine")
            if found.status_code == 200:
                told.add((found.json()["samples"], found.json()["max_samples"]))
    assert answer.result().status_code == 200
    assert {most for _, most in told} == {256} and {taken for taken, _ in told} <= set(range(0, 256, 16))
    assert server.http.get("/v1/compare/mine").status_code == 204, "it has ended"


def test_going_away_ends_the_work(server: Server) -> None:
    sides = [document(samples=2**24, roulette_depth=each) for each in (1, 3)]

    def under_way() -> float:
        found = metrics(server)
        return sum(found[f'sunbox_renders{{state="{state}"}}'] for state in ("queued", "running"))

    def scenes() -> int:
        return int(server.http.get("/v1/info").json()["memory"]["used"].get("scenes", 0))

    wait_until(lambda: under_way() == 0)  # what other tests have begun
    before = scenes()
    connection = HTTPConnection(server.url.removeprefix("http://"))
    body = json.dumps({"a": sides[0], "b": sides[1]})
    connection.request("POST", "/v1/compare", body, {"content-type": "application/json"})
    wait_until(lambda: under_way() == 2)
    connection.close()
    wait_until(lambda: under_way() == 0)
    wait_until(lambda: scenes() <= before)
