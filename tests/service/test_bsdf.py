"""`POST /v1/bsdf` and `/v1/bsdf/albedo`: the numbers of the renderer, bounds, and mistakes with their pointers."""

from __future__ import annotations

import json
import math
import os
import signal
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx
import numpy as np
import pytest

from service.server.requests.bsdf_request import MOST_PAIRS, MOST_WORK, in_plane, normalized
from service.server.routes.bsdf import _values
from tests import baseline
from tests.probing import materials
from tests.serving import ENDLESS, Server, client

GREY = {"type": "diffuse", "albedo": 0.5}
METAL = {"type": "metal_rough", "base_color": [1, 0.78, 0.34], "metallic": 1, "roughness": 0.5}
GLASS = {"type": "principled", "base_color": "#ffffff", "roughness": 0, "transmission": 1, "ior": 1.5}
UP = [[0, 0, 1]]


def ask(server: Server, material: Any, wo: Any = UP, wi: Any = UP) -> httpx.Response:
    return server.http.post("/v1/bsdf", json={"material": material, "wo": wo, "wi": wi})


def mistakes(answer: httpx.Response) -> list[str]:
    assert answer.status_code == 422, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    return [error["pointer"] for error in answer.json()["errors"]]


def test_values_of_every_pair(server: Server) -> None:
    wo, wi = [[3, 0, 4], [0, 0, 0.5], [0, 1, -1]], [[0, 0, 2], [-0.6, 0, 0.8], [0.3, 0.2, 0.1], [0, 0, -1]]
    found = ask(server, METAL, wo, wi).json()
    material = materials(base_color=(1, 0.78, 0.34), metallic=1, roughness=0.5)[0]
    unit = normalized(np.array(wi, float))
    for f, direction in zip(found["f"][:2], normalized(np.array(wo, float))[:2], strict=True):
        np.testing.assert_allclose(f[:3], baseline.metal_rough(material, direction, unit[:3]), rtol=1e-4)
        assert f[3] == [0, 0, 0]
    assert not np.any(found["f"][2]) and not np.any(found["pdf"][2])  # from behind
    assert np.shape(found["f"]) == (3, 4, 3) and np.shape(found["pdf"]) == (3, 4)
    assert found["delta"] == [[], [], []]


def test_clear_glass_has_two_specular_lobes(server: Server) -> None:
    answer = ask(server, GLASS, UP, [[0.1, 0, 1]])
    assert "-0.0" not in answer.text
    mirrored, refracted = answer.json()["delta"][0]
    assert mirrored["wi"] == [0, 0, 1] and refracted["wi"] == [0, 0, -1]
    assert mirrored["weight"] == pytest.approx([0.04] * 3, rel=1e-5)
    assert refracted["weight"] == pytest.approx([0.96] * 3, rel=1e-5)
    assert [mirrored["probability"], refracted["probability"]] == pytest.approx([0.04, 0.96], rel=1e-5)


def test_lobes_are_answered_where_they_are_asked_for(server: Server) -> None:
    body = {"material": METAL | {"metallic": 0}, "wo": [[0.6, 0, 0.8]], "wi": [[-0.6, 0, 0.8], [0, 0, 1]]}
    plain = server.http.post("/v1/bsdf", json=body).json()
    found = server.http.post("/v1/bsdf", json=body | {"lobes": True}).json()
    assert "lobes" not in plain and found["f"] == plain["f"]
    assert [lobe["name"] for lobe in found["lobes"]] == ["diffuse", "specular"]
    np.testing.assert_allclose(np.sum([lobe["f"] for lobe in found["lobes"]], axis=0), found["f"], rtol=1e-6)
    assert mistakes(server.http.post("/v1/bsdf", json=body | {"lobes": "yes"})) == ["/lobes"]


def test_albedo_and_its_error(server: Server) -> None:
    def albedo(material: Any, **given: Any) -> Any:
        return server.http.post("/v1/bsdf/albedo", json={"material": material, **given}).json()

    found = albedo(GREY, cosines=[1, 0.2])
    np.testing.assert_allclose(found["albedo"], 0.5, atol=1e-6)
    rough = {**METAL, "roughness": 1, "base_color": "#ffffff"}
    few, many = (albedo(rough, cosines=[0.3], samples=samples) for samples in (256, 65536))
    assert few["error"][0][0] / many["error"][0][0] == pytest.approx(16, rel=0.3)
    assert abs(few["albedo"][0][0] - many["albedo"][0][0]) < 5 * few["error"][0][0]
    single = albedo(rough, cosines=[0.3], samples=1)["error"][0]
    assert single[0] / few["error"][0][0] == pytest.approx(16, rel=0.4), "of one sample there is an error, too"
    assert albedo(GREY, cosines=[1], samples=1)["error"][0] == pytest.approx([0, 0, 0], abs=1e-6)


def test_terms(server: Server) -> None:
    def terms(material: Any, **given: Any) -> httpx.Response:
        return server.http.post("/v1/bsdf/terms", json={"material": material, "cosines": [1, 0.5], **given})

    found = terms(METAL, wo_cosine=1).json()
    alpha = 0.25
    expected = [1 / (math.pi * alpha**2), alpha**2 / (math.pi * (0.25 * (alpha**2 - 1) + 1) ** 2)]
    assert found["distribution"] == pytest.approx(expected, rel=1e-4)
    np.testing.assert_allclose(found["fresnel"][0], METAL["base_color"], rtol=1e-5)
    assert found["geometry"][0] == pytest.approx(1, rel=1e-5) and 0.5 < found["geometry"][1] < 1
    mirror = terms(GLASS).json()
    assert mirror["distribution"] is None and mirror["geometry"] is None
    assert mirror["fresnel"][0] == pytest.approx([0.04] * 3, rel=1e-4)
    assert mistakes(terms(GREY)) == ["/material/type"]
    assert mistakes(terms(METAL, cosines=[0.5, 0])) == ["/cosines/1"]
    assert mistakes(terms(METAL, wo_cosine=2)) == ["/wo_cosine"]


@pytest.mark.parametrize(
    ("change", "pointers"),
    [
        ({"material": {"type": "difuse", "albedo": 0.5}}, ["/material/type"]),
        ({"material": {"type": "diffuse", "albedo": 2}}, ["/material/albedo"]),
        ({"wo": [[0, 0, 1], [0, 0, 0]]}, ["/wo/1"]),
        ({"wi": [[0, 0, 1], [1e-50, 0, 0]]}, ["/wi/1"]),
        ({"wi": [[0, 0, 1], [1, 2]]}, ["/wi/1"]),
        ({"wi": [[0, 0, "1"]]}, ["/wi/0/2"]),
        ({"wo": [[0, 0, 1], [0, None, 1]]}, ["/wo/1/1"]),
        ({"wi": [[0, 0, 1], [2e9, 0, 1]]}, ["/wi/1/0"]),
        ({"wi": [[0, 0, 10**400]]}, ["/wi/0/2"]),
        ({"wo": []}, ["/wo"]),
        ({"wi": None}, ["/wi"]),
        ({"scene": {}}, ["/scene"]),
        ({"material": {"type": "diffuse", "albedo": {"texture": "t"}}}, ["/material/albedo"]),
        (
            {"material": {"type": "principled", "roughness": {"texture": "t"}, "normal_map": {"texture": "t"}}},
            ["/material/roughness", "/material/normal_map"],
        ),
    ],
)
def test_mistakes_are_pointed_at(server: Server, change: dict[str, Any], pointers: list[str]) -> None:
    body = {"material": GREY, "wo": UP, "wi": UP, **change}
    assert sorted(mistakes(server.http.post("/v1/bsdf", json=body))) == sorted(pointers)


@pytest.mark.parametrize(
    ("given", "pointer"),
    [
        ({"cosines": []}, "/cosines"),
        ({"cosines": [0.5, 0]}, "/cosines/1"),
        ({"cosines": [1.01]}, "/cosines/0"),
        ({"cosines": [1], "samples": 0}, "/samples"),
        ({"cosines": [1], "samples": (1 << 20) + 1}, "/samples"),
        ({"cosines": [1], "samples": 1.5}, "/samples"),
        ({}, "/cosines"),
    ],
)
def test_mistakes_about_the_albedo(server: Server, given: dict[str, Any], pointer: str) -> None:
    assert mistakes(server.http.post("/v1/bsdf/albedo", json={"material": GREY, **given})) == [pointer]


def test_too_many_pairs_or_samples(server: Server) -> None:
    side = math.isqrt(MOST_PAIRS)
    found = ask(server, GREY, UP * side, UP * side)
    assert found.status_code == 200 and np.shape(found.json()["f"]) == (side, side, 3)
    for n, m in ((1, MOST_PAIRS + 1), (70_000, 1), (side + 1, side)):
        refused = ask(server, GREY, UP * n, UP * m)
        assert refused.status_code == 413 and refused.headers["content-type"] == "application/problem+json"
        assert [error["pointer"] for error in refused.json()["errors"]] == ["/wi" if m > n else "/wo"]
    body = {"material": GREY, "cosines": [0.5] * (MOST_WORK // (1 << 20) + 1), "samples": 1 << 20}
    refused = server.http.post("/v1/bsdf/albedo", json=body)
    assert refused.status_code == 413 and refused.json()["errors"][0]["pointer"] == "/samples"
    body = {"material": GREY, "cosines": [0.5] * (MOST_PAIRS + 1), "samples": 1}
    refused = server.http.post("/v1/bsdf/albedo", json=body)
    assert refused.status_code == 413 and refused.json()["errors"][0]["pointer"] == "/cosines"


def test_a_stream_goes_on_beside_questions(server: Server) -> None:
    """Beside the longest question the stream gets its half of the time, and short ones wait for neither."""
    long = {"material": {**GLASS, "roughness": 0.4}, "cosines": [0.5] * 16, "samples": 1 << 20}
    with client(server) as stream, ThreadPoolExecutor(1) as threads:
        stream.start(settings=ENDLESS)
        first = stream.frame()
        server.http.post("/v1/bsdf/albedo", json={**long, "samples": 1}).raise_for_status()  # compiles
        ask(server, METAL).raise_for_status()
        under_way = threads.submit(server.http.post, "/v1/bsdf/albedo", json=long)
        seen = [first]
        while not under_way.done():
            seen.append(stream.frame())
            ask(server, METAL).raise_for_status()
        assert under_way.result().status_code == 200
        assert len(seen) > 5, "a frame and an answer in turn, while the long one is worked on"
        assert seen[-1].samples > seen[len(seen) // 2].samples > first.samples


def test_a_question_outlives_the_renderer(server: Server) -> None:
    long = {"material": {**GLASS, "roughness": 0.4}, "cosines": [0.5] * 16, "samples": 1 << 20}
    with ThreadPoolExecutor(1) as threads:
        under_way = threads.submit(server.http.post, "/v1/bsdf/albedo", json=long)
        time.sleep(0.3)
        os.kill(server.renderer(), signal.SIGKILL)
        assert under_way.result().status_code == 200


def test_directions_are_normalised() -> None:
    given = np.array([[1e9, 1e9, -1e9], [1e-30, 0, 0], [3.0, 0, 4.0]])
    np.testing.assert_allclose(np.linalg.norm(normalized(given), axis=1), 1, rtol=1e-15)
    plane = in_plane([1.0, 1e-8, 0.6])
    np.testing.assert_allclose(plane, [[0, 0, 1], [1, 0, 1e-8], [0.8, 0, 0.6]], rtol=1e-15)


def test_large_answers_are_written_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """The encoder keeps all other threads waiting for as long as it writes one text."""
    written = []
    dumps = json.dumps

    def counted(*args: Any, **options: Any) -> str:
        written.append(len(text := dumps(*args, **options)))
        return text

    monkeypatch.setattr(json, "dumps", counted)
    count, random = 3000, np.random.default_rng(1)
    arrays = {
        "f": random.random((count, 1, 3), np.float32),
        "pdf": random.random((count, 1), np.float32),
        "delta_wi": random.random((count, 2, 3), np.float32),
        "delta_weight": random.random((count, 2, 3), np.float32),
        "delta_probability": np.tile(np.array([0.25, 0], np.float32), (count, 1)),
        "lobes": np.zeros((0, count, 1, 3), np.float32),
    }
    answer = json.loads(_values(arrays))
    assert max(written) < 32 * 1024
    assert [len(lobes) for lobes in answer["delta"]] == [1] * count
    last = answer["delta"][-1][0]
    assert np.float32(last["wi"]).tolist() == arrays["delta_wi"][-1, 0].tolist() and last["probability"] == 0.25
