"""Batches along the times of a glTF file's animation."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest

from tests.gltf_files import Gltf
from tests.serving import SMALL, Server


def model() -> Gltf:
    """Two squares: one with a name that slides by 6 and ends flat, and one without that bends by a morph target."""
    file = Gltf()
    target = {"POSITION": file.accessor(np.tile(np.array([0, 4, 0], "<f4"), (4, 1)))}
    bending = file.node(mesh=file.mesh(file.primitive(targets=[target])), translation=[0, 0, -4])
    sliding = file.node(name="Square", mesh=file.mesh())
    lamp = file.node(name="Lamp", extensions={"KHR_lights_punctual": {"light": 0}})
    lights = [{"type": "point", "intensity": 100}]
    file.tree["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    file.animation(
        "Slide",
        (sliding, "translation", "LINEAR", [0, 2], [[0, 0, 0], [6, 0, 0]]),
        (sliding, "scale", "STEP", [0, 3], [[1, 1, 1], [1, 0, 1]]),
        (bending, "weights", "LINEAR", [0, 2], [0, 1]),
        (lamp, "translation", "LINEAR", [0, 2], [[0, 0, 5], [0, 2, 5]]),
    )
    return file


@pytest.fixture(scope="module")
def uploaded(server: Server) -> str:
    return str(server.http.post("/v1/assets", content=model().glb()).raise_for_status().json()["id"])


def ended(server: Server, scene: Any, over: Any) -> Any:
    body = {"scene": scene, "settings": SMALL, "over": over}
    id = server.http.post("/v1/batches", json=body).raise_for_status().json()["id"]
    return server.http.get(f"/v1/batches/{id}?wait=60").raise_for_status().json()


def pixels(answer: Any) -> np.ndarray:
    found: np.ndarray = np.load(io.BytesIO(answer.raise_for_status().content))
    return found


def test_each_time_is_posed_anew(server: Server, uploaded: str) -> None:
    """In a scene that was opened at another time, and in which materials and the order of shapes are its own."""
    http = server.http
    url = f"/v1/assets/{uploaded}/scene"
    scene = http.get(f"{url}?animation=Slide&time=0.5").json()
    saved = http.get(url).json()
    scene["shapes"][0] = saved["shapes"][0]  # known by its mesh at rest, as it has no name
    scene["materials"] = {"own": {"type": "diffuse", "albedo": 0.5}}
    ball = {"type": "sphere", "center": [0, -3, 0], "radius": 1}
    scene["shapes"] = [{**shape, "material": "own"} for shape in (ball, *scene["shapes"])]
    axes = [{"time": [1, 9], "asset": uploaded, "animation": "Slide"}, {"path": "/camera/vfov", "values": [30, 50]}]
    batch = ended(server, scene, axes)
    assert batch["state"] == "done" and len(batch["renders"]) == 4
    documents = [http.get(f"/v1/renders/{each['id']}/scene").json()["scene"] for each in batch["renders"]]
    then = http.get(f"{url}?animation=Slide&time=1").json()
    first = documents[0]["shapes"]
    assert first[0] == scene["shapes"][0] and all(shape["material"] == "own" for shape in first)
    assert [shape["asset"] for shape in first[1:]] == [shape["asset"] for shape in then["shapes"]]
    assert first[1]["asset"] != saved["shapes"][0]["asset"], "the morph target makes another mesh"
    assert first[2]["transform"]["matrix"][3] == 3
    assert documents[0]["lights"][0]["position"] == [0, 1, 5]
    assert [document["camera"]["vfov"] for document in documents] == [30, 50, 30, 50]
    assert documents[2]["shapes"][2]["transform"] == {"scale": 1e-6}, "flat at 9 s"
    single = http.post("/v1/render?format=npy", json={"scene": documents[1], "settings": SMALL})
    member = http.get(f"/v1/renders/{batch['renders'][1]['id']}/image?format=npy")
    assert np.array_equal(pixels(single), pixels(member))


def test_refusals(server: Server, uploaded: str) -> None:
    http = server.http
    scene = http.get(f"/v1/assets/{uploaded}/scene").json()
    axis = {"time": [0], "asset": uploaded, "animation": "Slide"}
    bare = {**scene, "lights": [], "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}]}
    bare["materials"] = {"m": {"type": "diffuse", "albedo": 0.5}}
    for document, change, status, pointer, told in (
        (scene, {"animation": "Walk"}, 404, "/over/0/animation", "'Slide'"),
        (scene, {"asset": "sha256:" + "0" * 64}, 404, "/over/0/asset", "upload it first"),
        (bare, {}, 422, "/over/0/asset", "by their names"),
        (scene, {"time": []}, 422, "/over/0/time", "empty"),
        (scene, {"time": [0] * 501}, 422, "/over/0/time", "500"),
        (scene, {"poses": []}, 422, "/over/0/poses", ""),
    ):
        answer = http.post("/v1/batches", json={"scene": document, "over": [{**axis, **change}]})
        (error,) = answer.json()["errors"]
        assert (answer.status_code, error["pointer"]) == (status, pointer) and told in error["detail"]
