"""Hostile days, in short: mutated documents, files and messages, and whatever our own OpenAPI lets one ask for.

HOSTILE_DOCUMENTS, HOSTILE_FILES and HOSTILE_EXAMPLES say how many; `make hostile` is the long form.
"""

from __future__ import annotations

import asyncio
import io
import json
import os
import random
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, given, settings
from PIL import Image
from schemathesis.specs.openapi import checks

from service.document import presets
from service.server.routes.examples import SCENE
from tests import asset_files as make
from tests import serving
from tests.hostile import mutated_bytes, mutated_document, mutated_json
from tests.serving import KEYS, Client, Server

DOCUMENTS = int(os.environ.get("HOSTILE_DOCUMENTS", 80))
FILES = int(os.environ.get("HOSTILE_FILES", 30))
EXAMPLES = int(os.environ.get("HOSTILE_EXAMPLES", 2))
SEED = int(os.environ.get("HOSTILE_SEED", 1))
CHECKS = [
    schemathesis.checks.not_a_server_error,
    checks.status_code_conformance,
    checks.content_type_conformance,
    checks.response_schema_conformance,
    checks.response_headers_conformance,
]
PATIENCE_S = float(os.environ.get("HOSTILE_PATIENCE", 180))  # a later answer counts as none
AT_ONCE = 8
KEY = {"authorization": f"Bearer {KEYS[0]}"}
GROWTH = 150 << 20  # bytes: allocators, kernels and parsed assets, each of which has its bound
ENOUGH = 300  # documents: half of them fill the cache of kernels
SMALL = {"width": 8, "height": 8, "max_samples": 2}
LIMITS = {
    "SUNBOX_MAX_SECONDS": "3",
    "SUNBOX_MAX_PIXELS": "4096",
    "SUNBOX_MAX_TRIANGLES": "200000",
    "SUNBOX_PARSE_SECONDS": "5",
    "SUNBOX_KEEP_RENDERS": "4",
    "SUNBOX_DATA_QUOTA": "20000000",
}
EVERYTHING: dict[str, Any] = {
    **SCENE,
    "environment": {"type": "sky", "sun_elevation": 30, "sun_azimuth": 10, "rotation": 5},
    "lights": [
        {"type": "point", "position": [2, 4, 3], "intensity": 60},
        {"type": "spot", "position": [0, 4, 0], "direction": [0, -1, 0], "intensity": 9,
         "outer_angle": 9, "inner_angle": 1},
        {"type": "directional", "direction": [0, -1, -1], "irradiance": 2, "angular_diameter": 3},
    ],
    "textures": {"t": {"type": "checker", "a": 0.1, "b": "#ffcc00"}},
    "materials": {
        "coat": {"type": "principled", "base_color": {"texture": "t"}, "transmission": 0.5, "ior": 1.4},
        "floor": {"type": "blinn_phong", "diffuse": 0.5, "specular": 0.2, "shininess": 20, "alpha": 0.9},
        "disney": {"type": "disney", "roughness": {"texture": "t", "factor": 0.5}, "emission": 2},
        "metal": {"type": "metal_rough", "base_color": [1, 0.8, 0.3], "metallic": 1, "roughness": 0.2},
    },
    "shapes": [
        *SCENE["shapes"],
        {"type": "box", "min": [1, 0, 0], "max": [2, 1, 1], "material": "metal", "transform": {"rotate": [0, 20, 0]}},
        {"type": "sphere", "center": [-1, 1, 0], "radius": 0.3, "material": "disney",
         "transform": {"scale": [1, 2, 1]}},
        {"type": "mesh", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]], "material": "coat"},
    ],
}  # fmt: skip


@pytest.fixture(scope="module")
def modest(server: Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server of its own, whose memory nobody else uses, with narrow limits but those of bodies."""
    served = Server(tmp_path_factory.mktemp("modest"), **LIMITS)
    served.wait()
    yield served
    served.wait()
    assert served.stop() == 0


def memory(server: Server) -> int:
    """Resident bytes of the server and its children."""
    sizes = [Path(f"/proc/{pid}/statm").read_text() for pid in (server.process.pid, *server.children())]
    return sum(int(size.split()[1]) for size in sizes) * os.sysconf("SC_PAGESIZE")


def documents() -> list[Any]:
    names = [entry["name"] for entry in presets.names("scenes")]
    return [EVERYTHING, EVERYTHING, *(presets.get("scenes", name) for name in names if name != "sphere-field")]


def is_fine(answer: httpx.Response) -> bool:
    """Done, or refused in good order."""
    if answer.status_code < 400:
        return True
    body = answer.json()
    fine = answer.headers["content-type"] == "application/problem+json" and body["status"] == answer.status_code
    meant = answer.status_code < 500 or (answer.status_code == 503 and "retry-after" in answer.headers)
    leaks = [word for word in ("Traceback", "/site-packages", "service/", ".py", "/data/") if word in answer.text]
    return fine and meant and not leaks and bool(body["detail"])


@pytest.mark.slow
def test_mutated_documents(modest: Server) -> None:
    rng = random.Random(SEED)
    bases = documents()
    told: Counter[int] = Counter()
    held = []
    for share in (DOCUMENTS // 2, DOCUMENTS - DOCUMENTS // 2):
        asyncio.run(_send_all(modest, [_document(bases, rng) for _ in range(share)], told))
        held.append(memory(modest))
    print("documents", dict(told), "memory", [size >> 20 for size in held], "MiB")
    assert told[422] > DOCUMENTS / 10 and told[200] > DOCUMENTS / 50
    if DOCUMENTS >= ENOUGH:
        assert held[1] - held[0] < GROWTH


def _document(bases: list[Any], rng: random.Random) -> tuple[str, str, bytes]:
    base = rng.choice(bases)
    kind = rng.randrange(6)
    if kind == 0:
        return "PUT", f"/v1/documents/scenes/d{rng.randrange(5)}", mutated_json(base, rng)
    if kind == 1:
        return "POST", "/v1/renders", mutated_json({"scene": base, "settings": {**SMALL, "seed": 3}}, rng)
    if kind == 2:
        return "POST", "/v1/render?format=npy", mutated_json({"scene": base, "settings": SMALL}, rng)
    scene = mutated_document(base, rng)
    return "POST", "/v1/render", json.dumps({"scene": scene, "settings": SMALL}).encode("utf-8", "surrogatepass")


async def _send_all(server: Server, requests: list[tuple[str, str, bytes]], told: Counter[int]) -> None:
    """Several at once. Each is answered in time, and no answer is a surprise."""
    waiting = list(reversed(requests))
    async with httpx.AsyncClient(base_url=server.url, timeout=PATIENCE_S) as http:

        async def send() -> None:
            while waiting:
                method, address, body = waiting.pop()
                answer = await http.request(method, address, content=body)
                told[answer.status_code] += 1
                assert is_fine(answer), (address, answer.status_code, answer.text[:500], body[:20_000])

        await asyncio.gather(*(send() for _ in range(AT_ONCE)))


def files() -> dict[str, bytes]:
    rng = np.random.default_rng(1)
    pixels = (rng.random((16, 24, 3)) * 255).astype(np.uint8)
    picture = Image.fromarray(pixels)
    encoded = {}
    for format in ("JPEG", "WEBP"):
        stream = io.BytesIO()
        picture.save(stream, format)
        encoded[format.lower()] = stream.getvalue()
    triangles = rng.random((20, 3, 3))
    corners = triangles.reshape(-1, 3).astype(np.float32)
    faces = np.arange(60).reshape(-1, 3)
    return {
        "a.obj": make.OBJ * 3,
        "a.ply": make.ply(corners, faces),
        "a.stl": make.stl(triangles),
        "b.stl": make.stl_text(triangles),
        "a.glb": make.glb(make.gltf()),
        "a.gltf": make.embedded(make.gltf()),
        "a.png": make.png(pixels),
        "a.exr": make.exr(rng.random((16, 24, 3)).astype(np.float32)),
        "a.hdr": make.hdr(rng.random((16, 24, 3)).astype(np.float32)),
        "a.jpg": encoded["jpeg"],
        "a.webp": encoded["webp"],
    }


@pytest.mark.slow
def test_mutated_files(modest: Server) -> None:
    rng = random.Random(SEED)
    good = files()
    for name, data in good.items():
        answer = modest.http.post("/v1/assets", content=data, params={"filename": name})
        assert answer.status_code == 201, (name, answer.text)
    told: Counter[int] = Counter()
    held = []
    for i in range(FILES):
        if i == FILES // 2:  # by now every parser has been at work
            held.append(memory(modest))
        name = list(good)[i % len(good)]
        data = mutated_bytes(good[name], rng)
        answer = modest.http.post("/v1/assets", content=data, params={"filename": name}, timeout=PATIENCE_S)
        told[answer.status_code] += 1
        assert is_fine(answer), (name, answer.status_code, answer.text[:500], data[:5000])
        if answer.status_code == 201:
            told[_used(modest, answer.json())] += 1
    held.append(memory(modest))
    print("files", dict(told), "memory", [size >> 20 for size in held], "MiB")
    assert told[422] > FILES / 10 and held[1] - held[0] < GROWTH


def _used(server: Server, asset: dict[str, Any]) -> int:
    """What became of a picture with what was taken."""
    if asset["kind"] == "scene":
        answer = server.http.get(f"/v1/assets/{asset['id']}/scene", timeout=PATIENCE_S)
        assert is_fine(answer), answer.text[:500]
        scene = answer.json() if answer.status_code == 200 else SCENE
    elif asset["kind"] == "mesh":
        scene = {**SCENE, "shapes": [{"type": "mesh", "asset": asset["id"], "material": "coat"}]}
    else:
        scene = {**SCENE, "environment": {"type": "image", "asset": asset["id"]}}
    answer = server.http.post("/v1/render", json={"scene": scene, "settings": SMALL}, timeout=PATIENCE_S)
    assert is_fine(answer), (asset, answer.text[:500])
    return answer.status_code


@pytest.mark.parametrize(
    "document",
    [serving.SCENE, pytest.param(EVERYTHING, marks=pytest.mark.slow)],  # of everything each other scene has a kernel
    ids=["a ball", "everything"],
)
def test_mutated_messages(strict: Server, document: dict[str, Any]) -> None:
    """The stream answers each with errors or frames, and goes on."""
    rng = random.Random(SEED)
    with Client(strict.url, key=KEYS[0]) as stream:
        stream.start(generation=1, scene=document, settings=SMALL, view={"format": "png", "max_fps": 30})
        for i in range(max(50, DOCUMENTS // 10)):
            patch = mutated_document({"materials": document["materials"], "shapes": document["shapes"]}, rng)
            message = {"type": "update", "generation": i + 2, "scene": patch, "settings": {"seed": 1}}
            data = mutated_json(rng.choice((message, {"type": "view", "exposure": 1, "aov": "depth"})), rng)
            stream.socket.send(data.decode("utf-8", "replace"))
        stream.say("start", generation=10**6, scene=SCENE, settings=SMALL)
        stream.say("view", format="jpeg", aov="color")
        assert stream.frame(10**6).samples >= 1


@pytest.fixture(scope="module")
def api(strict: Server) -> Any:
    return schemathesis.openapi.from_url(f"{strict.url}/openapi.json")


def test_whatever_is_described(api: Any) -> None:
    """Statuses, content types and shapes are the described ones, whatever is asked for."""
    asked = 0
    for operation in (found.ok() for found in api.get_all_operations()):
        if operation.path == "/v1/renders/events":  # an answer without an end, of which test_watching.py reads some
            continue

        @settings(
            max_examples=EXAMPLES,
            deadline=None,
            derandomize=True,
            database=None,
            phases=[Phase.explicit, Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        @given(case=operation.as_strategy())
        def ask(case: Any) -> None:
            nonlocal asked
            asked += 1
            case.call_and_validate(checks=CHECKS, timeout=PATIENCE_S, headers=KEY)

        ask()
    assert asked > 18 * EXAMPLES / 2
