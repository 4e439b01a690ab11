"""The REST interface, against a real server."""

from __future__ import annotations

import hashlib
import io
import os
import signal
import time
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import product
from pathlib import Path
from urllib.parse import urljoin, urlsplit

import httpx
import numpy as np
import pytest
from PIL import Image
from websockets.exceptions import ConnectionClosed

from service.formats.images import read_metadata
from tests.asset_files import OBJ, read_png
from tests.calls import is_problem, pixels, start, status
from tests.serving import ENDLESS, PATIENCE_S, SCENE, SMALL, Server, wait_until
from tests.serving import client as opened


@pytest.fixture
def http(server: Server) -> httpx.Client:
    return server.http


@pytest.fixture
def running(http: httpx.Client) -> Iterator[str]:
    """A render without end, with some samples."""
    id = start(http, ENDLESS)["id"]
    wait_until(lambda: status(http, id)["samples"] > 0)
    yield id
    http.delete(f"/v1/renders/{id}")


def test_one_shot(http: httpx.Client) -> None:
    before = {render["id"] for render in http.get("/v1/renders").json()}
    answer = http.post("/v1/render", json={"scene": SCENE, "settings": SMALL}, params={"format": "webp"})
    assert answer.status_code == 200 and answer.headers["content-type"] == "image/webp"
    assert Image.open(io.BytesIO(answer.content)).size == (32, 24)
    assert {render["id"] for render in http.get("/v1/renders").json()} <= before  # it is kept nowhere


def test_a_render_from_queued_to_done(http: httpx.Client) -> None:
    answer = http.post("/v1/renders", json={"scene": SCENE, "settings": SMALL})
    assert answer.status_code == 202
    location = answer.headers["location"]
    assert location.startswith("renders/"), "relative, so that it holds under a subpath"
    address = urlsplit(urljoin(str(answer.url), location)).path
    assert answer.json()["state"] == "queued"
    done = http.get(address, params={"wait": PATIENCE_S}).json()
    assert done["state"] == "done" and done["reason"] == "max_samples" and done["samples"] == 8
    assert done["noise"] > 0 and done["elapsed_s"] > 0 and done["setup_s"] > 0 and done["eta_s"] == 0
    assert done["warnings"] == [] and done["settings"]["max_bounces"] == 8 and done["settings"]["width"] == 32
    assert "kernel" not in done
    kernel = http.get(address, params={"kernel": "true"}).json()["kernel"]
    assert {"disney", "spheres", "quads", "environment"} <= set(kernel["raised"]) and "bvh" in kernel["not_raised"]
    assert kernel["compile_ms"] >= 0 and not set(kernel["raised"]) & set(kernel["not_raised"])
    assert done["id"] in [render["id"] for render in http.get("/v1/renders").json()]
    assert http.delete(address).status_code == 204 and http.get(address).status_code == 410


def test_the_same_request_gives_the_same_bits(http: httpx.Client) -> None:
    ids = [start(http, {**SMALL, "max_samples": 100})["id"] for _ in range(3)]  # side by side
    for id in ids:
        assert status(http, id, PATIENCE_S)["state"] == "done"
    first, *others = (pixels(http, id) for id in ids)
    assert all(np.array_equal(first, other) for other in others)


def test_every_format_of_every_aov(http: httpx.Client, running: str) -> None:
    types = {
        "png": "image/png",
        "jpeg": "image/jpeg",
        "webp": "image/webp",
        "exr": "image/x-exr",
        "hdr": "image/vnd.radiance",
        "npy": "application/octet-stream",
    }
    for aov, (format, mime) in product(("color", "albedo", "normal", "depth", "variance", "shape_id"), types.items()):
        answer = http.get(f"/v1/renders/{running}/image", params={"format": format, "aov": aov})
        assert answer.status_code == 200 and answer.headers["content-type"] == mime, (format, aov)
        assert len(answer.content) > 50, (format, aov)  # the WebP that is black but for one pixel has 64


def test_image_shapes_and_depths(http: httpx.Client) -> None:
    id = start(http)["id"]
    status(http, id, PATIENCE_S)
    for aov, channels in {"color": 4, "albedo": 3, "normal": 3, "depth": 1, "variance": 3, "incidence": 1}.items():
        array = pixels(http, id, aov)
        assert array.shape == (24, 32, channels) and array.dtype == np.float32
    png = http.get(f"/v1/renders/{id}/image").content
    assert read_metadata(png)["samples"] == 8
    bright = http.get(f"/v1/renders/{id}/image", params={"exposure": 2, "tone_map": "linear"}).content
    assert np.array(Image.open(io.BytesIO(bright))).mean() > np.array(Image.open(io.BytesIO(png))).mean()
    sixteen = http.get(f"/v1/renders/{id}/image", params={"bits": 16}).content
    assert sixteen[24] == 16  # IHDR's bit depth


def test_displayed_colours_go_through_a_cube(http: httpx.Client, running: str) -> None:
    cube = http.post("/v1/assets", content=b"LUT_1D_SIZE 2\n1 1 1\n0 0 0\n").json()
    assert cube["kind"] == "lut"
    http.delete(f"/v1/renders/{running}")
    image = f"/v1/renders/{running}/image"
    plain, turned = (
        read_png(http.get(image, params=query).content).astype(int) for query in ({}, {"lut": cube["id"]})
    )
    assert np.abs(255 - plain[..., :3] - turned[..., :3]).max() <= 1
    mesh = http.post("/v1/assets", content=OBJ).json()["id"]
    for lut in (mesh, "sha256:" + "0" * 64, "x"):
        assert is_problem(http.get(image, params={"lut": lut}), 422, "/lut")
    assert is_problem(http.post("/v1/render?lut=x", json={"scene": SCENE}), 422, "/lut")


def test_bad_image_queries(http: httpx.Client, running: str) -> None:
    for query, name in (
        ("bits=12", "bits"),
        ("bits=16&format=jpeg", "bits"),
        ("format=gif", "format"),
        ("aov=beauty", "aov"),
        ("exposure=nan", "exposure"),
        ("exposure=61", "exposure"),
        ("tone_map=filmic", "tone_map"),
        ("color_space=p3", "color_space"),
        ("color_space=display_p3&tone_map=ocio:sRGB - Display/Raw", "color_space"),
        ("format=avif&tone_map=ocio:Rec.2100-PQ - Display/Raw", "tone_map"),
        ("tone_map=ocio:sRGB - Display/ACES 1.0", "tone_map"),
        ("tonemap=aces", "tonemap"),
    ):
        for answer in (
            http.get(f"/v1/renders/{running}/image?{query}"),
            http.post(f"/v1/render?{query}", json={"scene": SCENE}),
        ):
            assert is_problem(answer, 422, f"/{name}"), query


def test_cancelling(http: httpx.Client, running: str) -> None:
    assert http.delete(f"/v1/renders/{running}").status_code == 204
    assert status(http, running)["state"] == "cancelled"  # at once, and the render is endless
    wait_until(lambda: status(http, running)["reason"] == "stopped")
    samples = status(http, running)["samples"]
    image = pixels(http, running)
    time.sleep(0.2)
    assert status(http, running)["samples"] == samples and np.array_equal(pixels(http, running), image)


def test_no_image_before_the_first_sample(http: httpx.Client) -> None:
    large = {"width": 1500, "height": 1500, "max_bounces": 64}
    id = start(http, large)["id"]
    answer = http.get(f"/v1/renders/{id}/image")
    http.delete(f"/v1/renders/{id}")
    assert is_problem(answer, 409)


def test_time_limit_ends_a_render(http: httpx.Client) -> None:
    """How well it is kept, tests/service/test_cli.py shows in a time of its own."""
    done = status(http, start(http, {"width": 96, "height": 96, "time_limit": 0.5})["id"], PATIENCE_S)
    assert done["reason"] == "time_limit" and done["settings"]["max_samples"] is None
    assert done["elapsed_s"] > 0.25 and done["samples"] > 0


def test_target_noise(http: httpx.Client) -> None:
    id = start(http, {"width": 64, "height": 64, "target_noise": 0.1})["id"]
    done = status(http, id, PATIENCE_S)
    assert done["reason"] == "target_noise" and done["noise"] <= 0.1 and done["samples"] >= 16


@pytest.mark.parametrize(
    ("body", "status", "pointers"),
    [
        (b"", 400, []),
        (b"{", 400, []),
        (b'{"scene": {}, "scene": {}}', 400, []),
        (b'"\xff"', 400, []),
        (b"[" * 100_000, 400, []),
        (b"[]", 422, [""]),
        (b"{}", 422, ["/scene"]),
        (b'{"scene": NaN}', 422, ["/scene"]),
        (b'{"scene": 1e999, "settings": {"seed": -Infinity}}', 422, ["/scene", "/settings/seed"]),
    ],
)
@pytest.mark.parametrize("address", ["/v1/render", "/v1/renders"])
def test_bad_bodies(http: httpx.Client, address: str, body: bytes, status: int, pointers: list[str]) -> None:
    answer = http.post(address, content=body)
    assert is_problem(answer, status, *pointers)
    assert "NaN" not in answer.text or status == 422


def test_a_mistake_of_a_scene_is_pointed_at(http: httpx.Client) -> None:
    """Which there are and what is said of each, `tests/service/document/test_refusals.py` has."""
    materials = {"ball": {"type": "diffuse", "albedo": 2}, "floor": {"type": "disney"}}
    answer = http.post("/v1/renders", json={"scene": {**SCENE, "materials": materials}})
    assert is_problem(answer, 422, "/scene/materials/ball/albedo")


def test_what_is_not_there(http: httpx.Client) -> None:
    for name in (
        "nothing",
        "renders/nobody",
        "renders/nobody/image",
        "assets/sha256:0",
        "presets/shapes",
        "presets/scenes/x",
    ):
        assert is_problem(http.get(f"/v1/{name}"), 404)
    assert is_problem(http.get("/nothing"), 404)
    assert is_problem(http.delete("/v1/renders/nobody"), 404)
    for method in ("POST", "PUT", "DELETE", "PATCH", "OPTIONS"):
        for path in ("/v1/nothing", "/v1/renders/nobody/nothing", "/nothing.js", "/%00", f"/{'n' * 300}"):
            answer = http.request(method, path)
            assert is_problem(answer, 404) and "allow" not in answer.headers, (method, path)
    for path, allowed in {"/v1/info": "GET, HEAD", "/v1/renders": "GET, HEAD, POST", "/v1/render": "POST"}.items():
        answer = http.request("PATCH", path)
        assert is_problem(answer, 405) and answer.headers["allow"] == allowed
    assert is_problem(http.get("/v1/render"), 405)
    for path in ("/", "/main.js"):
        answer = http.post(path)
        assert is_problem(answer, 405) and answer.headers["allow"] == "GET, HEAD"
    assert is_problem(http.get("/v1/renders/nobody?wait=-1"), 422, "/wait")


def test_assets(http: httpx.Client) -> None:
    id = "sha256:" + hashlib.sha256(OBJ).hexdigest()
    for _ in range(2):
        answer = http.post("/v1/assets", content=OBJ, params={"filename": "a.obj"})
        assert answer.status_code == 201
        stored = answer.json()
        assert (stored["id"], stored["kind"], stored["bytes"], stored["triangles"]) == (id, "mesh", len(OBJ), 1)
    assert http.get(f"/v1/assets/{id}").content == OBJ
    mesh = {"type": "mesh", "asset": id, "material": "ball"}
    render = start(http, scene={**SCENE, "shapes": [mesh]})
    assert status(http, render["id"], PATIENCE_S)["state"] == "done"
    assert is_problem(http.post("/v1/assets", content=b"v 1 nan 0\nf 1 1 1\n", params={"filename": "a.obj"}), 422)
    assert is_problem(http.post("/v1/assets", content=b"hello"), 415)


def test_a_form_with_a_file_is_refused_with_what_would_be_right(http: httpx.Client) -> None:
    answer = http.post("/v1/assets", files={"file": ("triangle.obj", OBJ + b"#" * (1 << 20))})
    assert is_problem(answer, 415) and "as the body" in answer.json()["detail"]


def test_the_answer_to_an_upload_always_has_warnings(http: httpx.Client) -> None:
    answer = http.post("/v1/assets", content=OBJ, params={"filename": "triangle.obj"})
    assert answer.json()["warnings"] == []


def test_every_preset_is_there(http: httpx.Client) -> None:
    for kind in ("scenes", "materials", "environments"):
        listed = http.get(f"/v1/presets/{kind}").json()
        assert listed and all({"name", "title"} == entry.keys() - {"kind", "source", "group"} for entry in listed)
        assert any("group" in entry for entry in listed) is (kind == "scenes")
        assert all(("kind" in entry) is (kind == "materials") for entry in listed)
        for entry in listed:
            assert "title" not in http.get(f"/v1/presets/{kind}/{entry['name']}").json()


def test_the_service_describes_itself(http: httpx.Client) -> None:
    assert http.get("/healthz").status_code == http.get("/readyz").status_code == 200
    info = http.get("/v1/info").json()
    assert info["limits"]["max_message"] == 1 << 20 and info["limits"]["max_seconds"] is None
    assert {"keep_seconds", "data_quota", "max_clients", "parse_memory"} <= info["limits"].keys()
    assert info["renderer"]["renderer"] and info["limits"]["max_pixels"] and info["quality"]["draft"]["max_samples"]
    schema = http.get("/v1/schema").json()
    assert schema.keys() == {"scene", "settings", "view"}
    assert schema["view"]["properties"]["exposure"]["maximum"] == 60
    paths = http.get("/openapi.json").json()["paths"]
    assert {"/v1/render", "/v1/renders", "/v1/renders/{id}/image", "/v1/assets", "/v1/info"} <= paths.keys()


def test_pages_come_from_here_alone(http: httpx.Client) -> None:
    for address in ("/", "/docs"):
        answer = http.get(address)
        assert answer.status_code == 200 and answer.headers["content-type"].startswith("text/html")
        assert "'self'" in answer.headers["content-security-policy"]
        assert 'src="http' not in answer.text and 'href="http' not in answer.text and 'src="/' not in answer.text
    assert http.get("/docs.js").status_code == http.get("/docs.css").status_code == 200


@pytest.mark.parametrize("host", ["evil.example", "evil.example:8000", "", "127.0.0.1.evil.example"])
def test_foreign_hosts_on_a_loopback_address(http: httpx.Client, host: str) -> None:
    assert is_problem(http.get("/v1/info", headers={"host": host}), 403)


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1:1234", "[::1]:80"])
def test_own_hosts(http: httpx.Client, host: str) -> None:
    assert http.get("/v1/info", headers={"host": host}).status_code == 200


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://localhost:1"])
def test_foreign_origins_change_nothing(http: httpx.Client, origin: str) -> None:
    for method, address in (("POST", "/v1/renders"), ("POST", "/v1/assets"), ("DELETE", "/v1/renders/x")):
        assert is_problem(http.request(method, address, headers={"origin": origin}), 403)
    answer = http.get("/v1/info", headers={"origin": origin})
    assert answer.status_code == 200 and "access-control-allow-origin" not in answer.headers


def test_own_origin_may(server: Server) -> None:
    answer = server.http.post("/v1/assets", content=OBJ, headers={"origin": server.url})
    assert answer.status_code == 201


def test_the_end_is_told_to_all_and_leaves_nothing(mortal: Server) -> None:
    """Streams and events end, nobody waits, and no process stays, nor an error in the log; also where the server is
    told several times in a row, as `timeout` does it."""
    id = start(mortal.http, ENDLESS)["id"]
    wait_until(lambda: status(mortal.http, id)["samples"] > 0)
    children, before = mortal.children(), len(mortal.log.read_text())
    assert children
    with ExitStack() as stack:
        stream = stack.enter_context(opened(mortal))
        stream.start(settings=ENDLESS)
        stream.frame()
        paths = (f"/v1/renders/{id}/events", "/v1/renders/events")
        events = [stack.enter_context(mortal.http.stream("GET", path)).iter_lines() for path in paths]
        assert [next(lines) for lines in events] == ["event: progress"] * 2
        for number in (signal.SIGTERM, *[signal.SIGINT] * 4):
            mortal.process.send_signal(number)
            time.sleep(0.002)
        assert mortal.process.wait(PATIENCE_S) == 0
        assert not any("event: done" in lines for lines in events)
        with pytest.raises(ConnectionClosed) as closed:
            stream.until("never")
        assert closed.value.rcvd is not None and closed.value.rcvd.code == 1001
    wait_until(lambda: not [pid for pid in children if Path(f"/proc/{pid}").exists()])
    log = mortal.log.read_text()[before:]
    assert "session ended" in log and "Traceback" not in log and "error" not in log, log


def test_children_end_when_the_server_is_killed(mortal: Server) -> None:
    children = mortal.children()
    assert children
    os.kill(mortal.process.pid, signal.SIGKILL)
    mortal.process.wait()
    wait_until(lambda: not [pid for pid in children if Path(f"/proc/{pid}").exists()])
