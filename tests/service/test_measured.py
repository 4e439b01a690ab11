"""Measured materials over HTTP: uploaded, rendered, edited in a stream, asked for their reflection, exported."""

from __future__ import annotations

import copy
import json
from typing import Any

import httpx
import numpy as np
import pytest

from service.document import references
from service.server.storage.documents import checked
from tests import measured_files
from tests.measured_files import Facets
from tests.serving import SCENE, SMALL, Server, client, wait_until
from tests.streams import RAW

ROUGH = Facets(diffuse=(0.6, 0.2, 0.1), alpha=(0.5, 0.5))


def uploaded(server: Server, file: bytes) -> str:
    answer = server.http.post("/v1/assets", content=file)
    assert answer.status_code == 201, answer.text
    assert answer.json()["kind"] == "measured"
    return str(answer.json()["id"])


def even(server: Server, albedo: float) -> str:
    """A MERL file that scatters to all sides alike."""
    return uploaded(server, measured_files.merl(lambda wo, wi: np.full((*wo.shape[:-1], 3), albedo / np.pi)))


@pytest.fixture(scope="module")
def bright(server: Server) -> str:
    """More light comes back than arrives."""
    return even(server, 2)


@pytest.fixture(scope="module")
def rough(server: Server) -> str:
    arrays = measured_files.adaptive(ROUGH, side=16, fine=32)
    return uploaded(server, measured_files.tensor_file(arrays))


def measured(asset: str) -> dict[str, Any]:
    return {"type": "measured", "asset": asset}


def scene(material: dict[str, Any]) -> dict[str, Any]:
    out = copy.deepcopy(SCENE)
    out["materials"]["ball"] = material
    return out


def mistakes(answer: httpx.Response) -> list[str]:
    assert answer.status_code == 422, answer.text
    return [error["pointer"] for error in answer.json()["errors"]]


def test_the_server_says_that_it_reads_them(server: Server) -> None:
    assert server.http.get("/v1/info").json()["formats"]["measured"] == ["binary", "bsdf"]


def test_the_reflection_of_a_file(server: Server, rough: str) -> None:
    rng = np.random.default_rng(1)
    w = rng.normal(size=(2, 40, 3))
    w[..., 2] = np.abs(w[..., 2]) + 0.5
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    asked = {"material": measured(rough), "wo": w[0].tolist(), "wi": w[1].tolist(), "lobes": True}
    found = server.http.post("/v1/bsdf", json=asked).json()
    expected = ROUGH(w[0][:, None], w[1][None])
    assert np.median(np.abs(found["f"] / expected - 1)) < 0.03
    assert np.min(found["pdf"]) > 0 and found["delta"] == [[]] * 40
    asked = {"material": measured(rough), "cosines": [1, 0.5], "samples": 4096}
    albedo = np.array(server.http.post("/v1/bsdf/albedo", json=asked).json()["albedo"])
    assert (albedo > [0.55, 0.18, 0.1]).all() and (albedo < [0.75, 0.4, 0.3]).all()
    asked = {"material": measured(rough), "cosines": [1]}
    assert mistakes(server.http.post("/v1/bsdf/terms", json=asked)) == ["/material/type"]


def test_files_that_are_missing_or_others(server: Server, rough: str) -> None:
    nothing = "sha256:" + "0" * 64
    (pointer,) = mistakes(
        server.http.post("/v1/bsdf", json={"material": measured(nothing), "wo": [[0, 0, 1]], "wi": [[0, 0, 1]]})
    )
    assert pointer == "/material/asset"
    answer = server.http.post("/v1/render", json={"scene": scene(measured(nothing)), "settings": SMALL})
    assert mistakes(answer) == ["/scene/materials/ball/asset"]
    mesh = {"type": "mesh", "asset": rough, "material": "ball"}
    body = {"scene": {**scene(measured(rough)), "shapes": [mesh]}, "settings": SMALL}
    answer = server.http.post("/v1/render", json=body)
    assert mistakes(answer) == ["/scene/shapes/0/asset"] and "measured reflection" in answer.text


def test_a_render_tells_of_a_file_that_gains_light(server: Server, bright: str) -> None:
    """The albedo AOV is what comes back after all: no more than what arrives."""
    furnace = {**scene(measured(bright)), "environment": {"type": "constant", "radiance": 1}}
    settings = {**SMALL, "max_samples": 64, "max_bounces": 8}
    status = server.http.post("/v1/renders?wait=100", json={"scene": furnace, "settings": settings}).json()
    (said,) = status["warnings"]
    assert said.startswith("/materials/ball/asset: it reflects more light than arrives")
    answer = server.http.get(f"/v1/renders/{status['id']}/image?format=npy&aov=albedo")
    albedo = np.frombuffer(answer.content[-32 * 24 * 12 :], np.float32).reshape(24, 32, 3)
    assert albedo[12, 16] == pytest.approx(1, abs=0.01)


@pytest.mark.slow
def test_an_edit_of_a_stream_shows_what_a_new_one_shows(server: Server, rough: str, bright: str) -> None:
    def shown(material: dict[str, Any]) -> np.ndarray:
        with client(server) as stream:
            stream.start(scene=scene(material), settings=SMALL, view=RAW)
            return stream.finished()[1].array()

    with client(server) as stream:
        stream.start(scene=SCENE, settings=SMALL, view=RAW)
        stream.finished()
        # From another model, to another file, with a slider of all materials, and back.
        for generation, material in enumerate(
            (measured(rough), measured(bright), {**measured(bright), "alpha": 0.5}, SCENE["materials"]["ball"]), 2
        ):
            gone = {name: None for name in ("asset", "albedo", "alpha")} | material
            stream.say("update", generation=generation, scene={"materials": {"ball": gone}})
            found = stream.finished()[1]
            assert found.generation == generation
            np.testing.assert_allclose(found.array(), shown(material), rtol=1e-4, atol=1e-5)


def test_documents_and_exports_know_the_file(server: Server, rough: str) -> None:
    assert references.references(scene(measured(rough))) == [rough]
    assert checked("materials", measured(rough)).uses == [("/asset", rough)]
    assert checked("materials", {"materials": {"a": measured(rough)}}).uses == [("/materials/a/asset", rough)]
    renamed = references.renamed({"materials": {"a": measured("x.bsdf")}}, {"x.bsdf": rough}.__getitem__)
    assert renamed == {"materials": {"a": measured(rough)}}
    answer = server.http.post("/v1/export", json={"scene": scene(measured(rough)), "format": "glb"})
    assert answer.status_code == 200, answer.text
    lost = json.loads(answer.headers["Sunbox-Lost"])
    assert {"/scene/materials/ball/type", "/scene/materials/ball/asset"} <= {each["pointer"] for each in lost}


def test_a_batch_varies_the_file(server: Server, bright: str) -> None:
    """Two of one kind, which have one kernel."""
    over = [{"path": "/materials/ball/asset", "values": [bright, even(server, 0.5)]}]
    body = {"scene": scene(measured(bright)), "settings": SMALL, "over": over}
    answer = server.http.post("/v1/batches", json=body)
    assert answer.status_code == 202, answer.text

    def ended() -> bool:
        state = server.http.get(f"/v1/batches/{answer.json()['id']}").json()
        return bool({each["state"] for each in state["renders"]} == {"done"})

    wait_until(ended, 0.5)
