"""Every kind of body is read the same in the server's process and, where it is large, beside it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any, get_args

import numpy as np
import pytest

from service.config import Config
from service.document import MeshShape, Scene
from service.problems import FieldError, ServiceError
from service.server.requests import parser_pool
from service.server.requests.bodies import SMALL
from service.server.requests.parser_pool import ParserPool
from service.server.requests.parsers import PARSERS, Kind
from tests.serving import SCENE, Server
from tests.serving import SMALL as SETTINGS

ROWS = [[0.5 * i, i % 7, -1e-3 * i] for i in range(5000)]
MESH = {"type": "mesh", "vertices": ROWS, "faces": [[0, 1, 2], [2, 3, 4]], "material": "ball"}
SPHERE = {"type": "sphere", "center": [0.125, 1.25, 1], "radius": 0.5, "material": "ball"}
LARGE = {**SCENE, "shapes": [*SCENE["shapes"], MESH, *[SPHERE] * 100]}
REQUEST = {"scene": LARGE, "settings": SETTINGS}
MATERIAL = {"type": "metal_rough", "base_color": [1, 0.78, 0.34], "metallic": 1, "roughness": 0.3}
DIRECTIONS = [[0.1234567, i / 10_000, 0.75] for i in range(4000)]
COSINES = [1 / (i + 1) for i in range(16_000)]
VALUES = {"path": "/materials/ball/roughness", "values": [i / 1000 for i in range(1000)]}

# One large body of each kind.
BODIES: dict[Kind, Any] = {
    "render": REQUEST,
    "keyed_render": REQUEST,
    "batch": {**REQUEST, "over": [VALUES]},
    "request": REQUEST,
    "scene": LARGE,
    "scenes": LARGE,
    "materials": MATERIAL,
    "bsdf": {"material": MATERIAL, "wo": [[0, 0, 1]], "wi": DIRECTIONS},
    "albedo": {"material": MATERIAL, "cosines": COSINES, "samples": 1},
    "terms": {"material": {"type": "microfacet"}, "cosines": COSINES},
    "conversion": {"material": MATERIAL, "to": "microfacet"},
    "comparison": {"a": REQUEST, "b": {**REQUEST, "settings": {**SETTINGS, "seed": 2}}},
    "export": {"scene": LARGE, "format": "glb"},
    "recipe": {"sunbox": "1", "scene": LARGE, "settings": {}, "samples": 1, "view": {}},
}


def config() -> Config:
    return Config(_env_file=None)  # type: ignore[call-arg]


@pytest.fixture(scope="module")
def pool() -> Iterator[ParserPool]:
    pool = ParserPool(config())
    yield pool
    pool.close()


def body_of(kind: Kind) -> bytearray:
    """The body, filled up with blanks where its kind has no place for more."""
    return bytearray(json.dumps(BODIES[kind]).encode().ljust(SMALL + 1))


def test_there_is_a_body_of_every_kind() -> None:
    assert BODIES.keys() == PARSERS.keys() == set(get_args(Kind))


@pytest.mark.parametrize("kind", BODIES)
def test_a_large_body_is_read_as_a_small_one_is(pool: ParserPool, kind: Kind) -> None:
    assert equal(pool.parse(kind, body_of(kind)), PARSERS[kind](config(), body_of(kind)))


def equal(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b)
    if is_dataclass(a):
        return type(a) is type(b) and all(equal(getattr(a, each.name), getattr(b, each.name)) for each in fields(a))
    return bool(a == b)


def test_every_class_of_errors_may_be_sent() -> None:
    def below(kind: type[ServiceError]) -> Iterator[type[ServiceError]]:
        yield kind
        for each in kind.__subclasses__():
            yield from below(each)

    for kind in below(ServiceError):
        if kind.__module__.startswith("service."):
            assert parser_pool.allowed(kind.__module__, kind.__qualname__) is kind
    assert parser_pool.allowed(FieldError.__module__, FieldError.__qualname__) is FieldError


@pytest.mark.parametrize("kind", ["render", "export", "comparison"])
def test_meshes_are_looked_at_again_wherever_an_answer_has_them(kind: Kind) -> None:
    """Compiled code reads the vertices that faces name, and the parser may have been taken over."""
    answer = PARSERS[kind](config(), body_of(kind))
    assert parser_pool._believed(answer) is answer
    scene: Scene = answer.a.scene if kind == "comparison" else answer.scene
    mesh = next(shape for shape in scene.shapes if isinstance(shape, MeshShape))
    object.__setattr__(mesh, "faces", np.array([[0, 1, len(ROWS)]], np.int32))
    with pytest.raises(parser_pool.ParserFailed):
        parser_pool._believed(answer)


def test_every_call_answers_a_large_body_as_a_small_one(server: Server) -> None:
    """Those that read JSON, by the API's description: its examples, with blanks behind."""
    sent = 0
    for path, calls in server.http.get("/openapi.json").json()["paths"].items():
        for method, call in calls.items():
            content = call.get("requestBody", {}).get("content", {}).get("application/json", {})
            for name, example in content.get("examples", {}).items():
                text, address = json.dumps(example["value"]).encode(), path.replace("{kind}", f"{name}s")
                for body in (text, text.ljust(SMALL + 1)):
                    answer = server.http.request(
                        method, address.replace("{name}", "large"), content=body,
                        headers={"content-type": "application/json"},
                    )  # fmt: skip
                    assert answer.status_code in (200, 201, 202), (path, name, len(body), answer.text)
                    sent += 1
    assert sent >= 20
    for kind in ("scenes", "materials"):
        server.http.delete(f"/v1/documents/{kind}/large")
