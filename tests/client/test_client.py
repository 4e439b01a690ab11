"""What a caller relies on: pixels, errors, uploads, Ctrl-C."""

from __future__ import annotations

import asyncio
import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import sunbox
from sunbox.merge import merged
from tests.asset_files import OBJ, png, read_exr
from tests.obj_files import zipped
from tests.serving import ENDLESS, LISTENS, SCENE, SMALL, Server, wait_until

GLASS = {"type": "principled", "transmission": 1, "roughness": 0}


@pytest.fixture(scope="module")
def client(server: Server) -> Iterator[sunbox.Client]:
    with sunbox.Client(server.url) as client:
        yield client


def test_import_takes_nothing_along() -> None:
    program = """
import sys, sunbox
print([m for m in ("numpy", "httpx2", "websockets", "PIL", "service") if m in sys.modules])"""
    assert subprocess.run([sys.executable, "-c", program], capture_output=True, text=True).stdout == "[]\n"


def test_client_takes_no_room_of_the_server_along() -> None:
    program = """
import sys, sunbox
sunbox.Client, sunbox.AsyncClient, sunbox.Stream
print([m for m in ("service", "gpu", "moderngl", "numba", "fastapi") if m in sys.modules])"""
    assert subprocess.run([sys.executable, "-c", program], capture_output=True, text=True).stdout == "[]\n"


def test_all_names_are_there() -> None:
    everywhere = set(sunbox.__all__) - {"View"}  # needs an extra; tests/client/test_view.py has it
    assert len(everywhere) == len(sunbox.__all__) - 1 and all(hasattr(sunbox, name) for name in everywhere)
    assert not hasattr(sunbox, "nothing")


def test_documents_are_saved(client: sunbox.Client) -> None:
    client.save("materials", "glass, clear", GLASS, shared=True)
    assert "glass, clear" in client.documents("materials")
    assert client.document("materials", "glass, clear") == GLASS
    client.delete_document("materials", "glass, clear")
    assert "glass, clear" not in client.documents("materials")
    with pytest.raises(sunbox.NotFound):
        client.document("materials", "glass, clear")


def test_pixels_are_those_of_the_server(client: sunbox.Client, server: Server) -> None:
    picture = client.render(SCENE, **SMALL)
    path = f"/v1/renders/{next(iter(client.jobs())).id}/image"
    expected = np.load(BytesIO(server.http.get(path, params={"format": "npy"}).content))
    assert np.array_equal(picture.numpy(), expected) and picture.numpy().dtype == np.float32
    assert picture.aov("depth").shape == (24, 32, 1)
    assert {"R", "albedo.R", "depth.Z"} <= set(read_exr(picture.exr()))
    assert Image.open(BytesIO(picture._repr_png_())).size == (32, 24)
    assert picture.samples == 8 and picture.noise > 0 and picture.warnings == [] and "32 x 24" in repr(picture)


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.webp", "a.exr", "a.hdr", "a.npy"])
def test_files_have_the_format_of_their_names(client: sunbox.Client, tmp_path: Path, name: str) -> None:
    job = next(iter(client.jobs(state="done")), None) or client.submit(SCENE, **SMALL)
    job.result().save(tmp_path / name)
    head = (tmp_path / name).read_bytes()[:12]
    magic = {
        "png": b"\x89PNG",
        "jpg": b"\xff\xd8",
        "webp": b"RIFF",
        "exr": b"\x76\x2f\x31\x01",
        "hdr": b"#?",
        "npy": b"\x93NUMPY",
    }
    assert head.startswith(magic[name[2:]])


def test_other_names_are_refused(client: sunbox.Client, tmp_path: Path) -> None:
    with pytest.raises(sunbox.Refused, match="must end in one of"):
        next(iter(client.jobs(state="done"))).result().save(tmp_path / "a.gif")


def test_refusals_have_pointer_and_sentence(client: sunbox.Client) -> None:
    with pytest.raises(sunbox.Refused) as refused:
        client.render(SCENE, width=0)
    assert (refused.value.status, refused.value.pointer) == (422, "/settings/width")
    assert "must be at least 1" in str(refused.value)
    with pytest.raises(sunbox.NotFound) as missing:
        client.job("nothing").status()
    assert missing.value.status == 404 and missing.value.pointer is None


def test_paths_are_uploaded_once(client: sunbox.Client, server: Server, tmp_path: Path) -> None:
    (tmp_path / "t.png").write_bytes(png(np.full((2, 2, 3), 200, np.uint8)))
    (tmp_path / "u.png").write_bytes((tmp_path / "t.png").read_bytes())
    textures = {name: {"asset": f"{name}.png"} for name in "tu"}
    materials = {**SCENE["materials"], "floor": {"type": "diffuse", "albedo": {"texture": "t"}}}
    (tmp_path / "scene.json").write_text(json.dumps({**SCENE, "textures": textures, "materials": materials}))
    before = server.log.read_text().count("path=/v1/assets ")
    for _ in range(2):
        assert client.render(tmp_path / "scene.json", **SMALL).samples == 8
    with sunbox.Client(server.url) as other:
        other.render(tmp_path / "scene.json", **SMALL)
    wait_until(lambda: server.log.read_text().count("path=/v1/assets ") > before)
    assert server.log.read_text().count("path=/v1/assets ") == before + 1


def test_one_of_several_models_of_a_zip(client: sunbox.Client, tmp_path: Path) -> None:
    path = tmp_path / "two.zip"
    path.write_bytes(zipped({"a.obj": OBJ, "in b/c&d.obj": OBJ.replace(b"0 1 0", b"0 2 0")}))
    with pytest.raises(sunbox.SunboxError, match=r"2 models, a\.obj and in b/c&d\.obj"):
        client.upload(path)
    scene = client.import_scene(path, entry="in b/c&d.obj")
    (shape,) = scene["shapes"]
    assert shape["asset"] == client.upload(path.read_bytes(), "two.zip", entry="c&d.obj")


def test_scene_is_not_changed(client: sunbox.Client) -> None:
    scene = {**SCENE, "camera": {"position": np.array([0, 0, 4.0]), "target": (0, 0, 0)}}
    before = scene["camera"]["position"]
    client.submit(scene, **SMALL).result()
    assert scene["camera"]["position"] is before


def test_what_is_no_scene_is_said(client: sunbox.Client, tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="dict or a path"):
        client.render(3)
    with pytest.raises(FileNotFoundError):
        client.render(tmp_path / "nothing.json")
    with pytest.raises(ValueError, match="not an address"):
        sunbox.Client("localhost:8000")


def test_label_and_idempotency(client: sunbox.Client) -> None:
    one, two = (client.submit(SCENE, label="twice", idempotency_key="k", **SMALL) for _ in range(2))
    assert one.id == two.id and [job.id for job in client.jobs(label="twice")] == [one.id]


def test_events_end_with_the_state(client: sunbox.Client) -> None:
    states = [status["state"] for status in client.submit(SCENE, **SMALL).events()]
    assert states[-1] == "done" and set(states) <= {"queued", "running", "done"}


def test_cancel_keeps_the_picture(client: sunbox.Client) -> None:
    job = client.submit(SCENE, **ENDLESS)
    wait_until(lambda: job.status()["samples"] > 0)
    job.cancel()
    assert job.result().samples > 0 and job.status()["state"] == "cancelled"
    job.delete()
    with pytest.raises(sunbox.NotFound):
        job.status()


def test_interrupt_cancels(server: Server, client: sunbox.Client) -> None:
    program = f"""
{LISTENS}
import sunbox
client = sunbox.Client({server.url!r})
job = client.submit({SCENE!r}, label="interrupted", **{ENDLESS!r})
print(job.id, flush=True)
job.result()
"""
    process = subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    job = client.job(process.stdout.readline().strip())
    wait_until(lambda: job.status()["samples"] > 0)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert "KeyboardInterrupt" in said and job.status()["state"] == "cancelled"


def test_cancelled_task_cancels_its_render(server: Server) -> None:
    async def cancelled() -> str:
        async with sunbox.AsyncClient(server.url) as client:
            before = {job.id async for job in client.jobs()}
            waiting = asyncio.create_task(client.render({**SCENE, "version": 1}, **ENDLESS))
            while not (running := [job async for job in client.jobs(state="running") if job.id not in before]):
                await asyncio.sleep(0.02)
            waiting.cancel()
            with pytest.raises(asyncio.CancelledError):
                await waiting
            return str((await running[0].status())["state"])

    assert asyncio.run(cancelled()) == "cancelled"


def test_bsdf_in_several_requests(client: sunbox.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    theta = np.linspace(-1.2, 1.2, 5)
    directions = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], 1)
    whole = client.bsdf(SCENE["materials"]["ball"], directions, directions)
    monkeypatch.setattr("sunbox.lobes.PAIRS", 3)
    parts = client.bsdf(SCENE["materials"]["ball"], directions, directions)
    assert whole.f.shape == (5, 5, 3) and np.array_equal(whole.f, parts.f) and np.array_equal(whole.pdf, parts.pdf)
    glass = client.bsdf(GLASS, [0, 0, 1], [0, 0, 1])
    assert {tuple(lobe.wi) for lobe in glass.delta[0]} == {(0, 0, 1), (0, 0, -1)}
    assert sum(lobe.probability for lobe in glass.delta[0]) == pytest.approx(1)


def test_albedo(client: sunbox.Client) -> None:
    answer = client.albedo({"type": "diffuse", "albedo": 0.5}, [1.0, 0.2])
    assert np.allclose(answer.albedo, 0.5, atol=0.01) and answer.error.shape == (2, 3)


def test_merge_replaces_another_type() -> None:
    ball = {"type": "sphere", "center": [0, 0, 0], "radius": 1}
    assert merged(ball, {"radius": 2, "center": None}) == {"type": "sphere", "radius": 2}
    assert merged(ball, {"type": "box", "min": [0, 0, 0]}) == {"type": "box", "min": [0, 0, 0]}
    assert merged({"a": {"b": 1}}, {"a": {"c": {"d": None}}}) == {"a": {"b": 1, "c": {}}}
