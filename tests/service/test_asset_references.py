"""Every place of a document that may name an asset, on every route that takes documents: another key's is refused."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.config import Config
from service.document import references, schema
from service.document.axes import PosedTimes
from service.problems import InvalidDocument
from service.server.app import create_app
from service.server.requests.request_parser import folded
from service.server.state import AppState
from tests.asset_files import OBJ, png
from tests.serving import SCENE, SMALL, Client, Server

BERT = {"authorization": "Bearer bert-key"}
MISSING = "sha256:" + "0" * 64
FACES = ("px", "nx", "py", "ny", "pz", "nz")
NAMES = {"name", "texture", "material", "layer"}  # the texts of a document that name something in it, or nothing
Step = str | int
Place = tuple[Step, ...]

# Parts of a scene, each with one asset, by the place where it stands: "*" and 0 are any member.
PARTS: dict[Place, Callable[[str, str], dict[str, Any]]] = {
    ("environment", "asset"): lambda id, own: {"environment": {"type": "image", "asset": id}},
    ("textures", "*", "asset"): lambda id, own: {"textures": {"*": {"asset": id}}},
    ("materials", "*", "asset"): lambda id, own: {"materials": {"*": {"type": "measured", "asset": id}}},
    ("shapes", 0, "asset"): lambda id, own: {"shapes": [{"type": "mesh", "asset": id, "material": "ball"}]},
}


def cubemap(face: str) -> Callable[[str, str], dict[str, Any]]:
    return lambda id, own: {"environment": {"type": "cubemap", "assets": dict.fromkeys(FACES, own) | {face: id}}}


PARTS |= {("environment", "assets", face): cubemap(face) for face in FACES}


def texts(node: dict[str, Any], definitions: dict[str, Any], place: Place = (), above: tuple[str, ...] = ()) -> Any:
    """The places of texts that may be anything, by a JSON schema."""
    if "$ref" in node:
        name = node["$ref"].rpartition("/")[2]
        if name not in above:
            yield from texts(definitions[name], definitions, place, (*above, name))
        return
    if node.get("type") == "string" and not node.keys() & {"enum", "const", "pattern"}:
        yield place
    below = [(place, each) for kind in ("anyOf", "oneOf", "allOf") for each in node.get(kind, ())]
    below += [((*place, name), each) for name, each in node.get("properties", {}).items()]
    below += [((*place, "*"), each) for each in [node.get("additionalProperties")] if isinstance(each, dict)]
    below += [((*place, 0), each) for each in [node.get("items"), *node.get("prefixItems", ())] if each]
    for where, each in below:
        if isinstance(each, dict):
            yield from texts(each, definitions, where, above)


def test_a_text_of_a_scene_names_an_asset_or_something_in_the_scene() -> None:
    every = schema()["scene"]
    found = {place for place in texts(every, every["$defs"]) if place[-1] not in NAMES}
    assert found == PARTS.keys(), "is it an asset? then references.places has to know it"
    for place, part in PARTS.items():
        assert [where for where, ref in references.places(part(MISSING, "own")) if ref == MISSING] == [place]


def document(place: Place, id: str, own: str) -> dict[str, Any]:
    part = PARTS[place](id, own)
    tables = {name: {**SCENE.get(name, {}), **part[name]} for name in ("materials", "textures") if name in part}
    return {**SCENE, **part, **tables}


def pointer(place: Place) -> str:
    return "".join(f"/{step}" for step in place)


Bodies = Iterator[tuple[Any, str]]  # a body, and the pointer of the reference in it


def of_scene(place: Place, id: str, own: str) -> Bodies:
    yield {"scene": document(place, id, own), "settings": SMALL}, f"/scene{pointer(place)}"


def of_export(place: Place, id: str, own: str) -> Bodies:
    yield {"scene": document(place, id, own), "format": "glb"}, f"/scene{pointer(place)}"


def of_compare(place: Place, id: str, own: str) -> Bodies:
    clean = {"scene": SCENE, "settings": SMALL}
    ((body, where),) = of_scene(place, id, own)
    yield {"a": body, "b": clean}, f"/a{where}"
    yield {"a": clean, "b": body}, f"/b{where}"


def of_batch(place: Place, id: str, own: str) -> Bodies:
    base, foreign = document(place, own, own), PARTS[place](id, own)
    twice = {"path": "/camera/vfov", "values": [30, 40]}
    values = {"path": pointer(place), "values": [own, own, id]}
    yield {"scene": document(place, id, own), "settings": SMALL, "over": [twice]}, f"/scene{pointer(place)}"
    yield {"scene": base, "settings": SMALL, "over": [twice, values]}, "/over/1/values/2"
    patches = {"patches": [{}, {"scene": foreign}]}
    yield {"scene": SCENE, "settings": SMALL, "over": [patches, twice]}, "/over/0/patches/1"
    # Where the other axes are at their first step, nothing is to be seen of it.
    hidden = {"patches": [{"scene": {place[0]: SCENE.get(str(place[0]))}}, {}]}
    yield {"scene": base, "settings": SMALL, "over": [values, hidden]}, "/over/0/values/2"


def of_saved_scene(place: Place, id: str, own: str) -> Bodies:
    yield document(place, id, own), pointer(place)


def of_saved_material(place: Place, id: str, own: str) -> Bodies:
    if place == ("materials", "*", "asset"):
        yield {"type": "measured", "asset": id}, "/asset"
        yield {"materials": {"*": {"type": "measured", "asset": id}}, "textures": {}}, pointer(place)
    elif place[0] == "textures":
        shows = {"type": "diffuse", "albedo": {"texture": "*"}}
        yield {"materials": {"shows": shows}, "textures": {"*": {"asset": id}}}, pointer(place)


def of_bsdf(**more: Any) -> Callable[[Place, str, str], Bodies]:
    def bodies(place: Place, id: str, own: str) -> Bodies:
        if place == ("materials", "*", "asset"):
            yield {"material": {"type": "measured", "asset": id}, **more}, "/material/asset"

    return bodies


# What takes documents, with the bodies that name one asset of another key.
TAKES: dict[str, Callable[[Place, str, str], Bodies]] = {
    "POST /v1/render": of_scene,
    "POST /v1/renders": of_scene,
    "POST /v1/batches": of_batch,
    "POST /v1/compare": of_compare,
    "POST /v1/export": of_export,
    "PUT /v1/documents/scenes/mine": of_saved_scene,
    "PUT /v1/documents/materials/mine": of_saved_material,
    "POST /v1/bsdf": of_bsdf(wo=[[0, 0, 1]], wi=[[0, 0, 1]]),
    "POST /v1/bsdf/albedo": of_bsdf(cosines=[1]),
}
# Bytes; a material whose file is not read; terms, which no measured material has.
TAKES_NONE = {"POST /v1/assets", "POST /v1/materials/convert", "POST /v1/bsdf/terms"}


def test_every_route_that_takes_a_body_is_known() -> None:
    paths = create_app(Config()).openapi()["paths"]
    found = {
        f"{method.upper()} {path}" for path, each in paths.items() for method in each if method in ("post", "put")
    }
    saved = "PUT /v1/documents/{kind}/{name}"
    assert found == {name if "/documents/" not in name else saved for name in TAKES} | TAKES_NONE


@pytest.fixture(scope="module")
def owned(strict: Server) -> tuple[str, str]:
    """A file of Anna's, and an image of Bert's."""

    def uploaded(key: str, data: bytes) -> str:
        headers = {"authorization": f"Bearer {key}"}
        return str(strict.http.post("/v1/assets", content=data, headers=headers).raise_for_status().json()["id"])

    return uploaded("anna-key", OBJ + b"# hers"), uploaded("bert-key", png(np.full((2, 2, 3), 9, np.uint8)))


@pytest.mark.parametrize("place", PARTS, ids=pointer)
def test_another_key_s_asset_is_refused_as_if_there_were_none(
    strict: Server, owned: tuple[str, str], place: Place
) -> None:
    foreign, own = owned
    for route, bodies in TAKES.items():
        method, path = route.split()
        for hers, missing in zip(bodies(place, foreign, own), bodies(place, MISSING, own), strict=True):
            answers = [strict.http.request(method, path, json=body, headers=BERT) for body, _ in (hers, missing)]
            assert answers[0].content.replace(foreign.encode(), MISSING.encode()) == answers[1].content, route
            if route == "POST /v1/export" and answers[0].status_code == 200:  # it has no place for it
                assert json.loads(answers[0].headers["sunbox-lost"])
            else:
                assert [each.status_code for each in answers] == [422, 422], (route, answers[0].text)
                told = answers[0].json()["errors"]
                assert [each["pointer"] for each in told] == [hers[1]], (route, told)
                assert foreign in told[0]["detail"], (route, told)
            assert strict.http.get(f"/v1/assets/{foreign}", headers=BERT).status_code == 404, route


def test_nor_does_a_stream_take_it(strict: Server, owned: tuple[str, str]) -> None:
    foreign, own = owned
    with Client(strict.url, key="bert-key") as client:
        client.start()
        for generation, place in enumerate(PARTS, 2):
            client.say("update", generation=generation, scene=PARTS[place](foreign, own))
            errors = client.until("error")[0]["problem"]["errors"]
            assert errors[0]["pointer"] == f"/scene{pointer(place)}", errors
    assert strict.http.get(f"/v1/assets/{foreign}", headers=BERT).status_code == 404


def test_the_file_of_times_is_its_key_s(strict: Server, owned: tuple[str, str]) -> None:
    over = [{"time": [0], "asset": owned[0], "animation": "walk"}]
    answer = strict.http.post("/v1/batches", json={"scene": SCENE, "settings": SMALL, "over": over}, headers=BERT)
    assert answer.status_code == 404 and answer.json()["errors"][0]["pointer"] == "/over/0/asset"


def test_what_a_pose_writes_is_checked() -> None:
    posed = PosedTimes(time=[0], asset="a", animation="b", poses=[{"shapes": {"3": {"asset": MISSING}}}])
    assert references.references(posed.written(0)) == [MISSING]


def test_a_document_is_packed_again_with_its_owner(tmp_path: Path) -> None:
    """So that what was not checked when it was stored, whyever, is refused at its turn."""
    app = create_app(Config(data_dir=tmp_path))
    state: AppState = app.state.sunbox
    id = state.storage.assets.add(OBJ).id
    state.storage.shares.uploaded("anna", [id])
    body = folded(document(("shapes", 0, "asset"), id, id))
    pack = state._pack
    assert asyncio.run(pack("anna", body, lambda size: None)).arrays is not None
    with pytest.raises(InvalidDocument) as refused:
        asyncio.run(pack("bert", body, lambda size: None))
    assert [each.pointer for each in refused.value.errors] == ["/scene/shapes/0/asset"]
    state.storage.assets.close()


def test_a_link_gives_the_assets_to_whoever_reads_it(strict: Server) -> None:
    data = OBJ + b"# behind a link"
    anna = {"authorization": "Bearer anna-key"}
    id = strict.http.post("/v1/assets", content=data, headers=anna).raise_for_status().json()["id"]
    linked = "/v1/documents/scenes/linked-0123456789abcdef"

    def put(**query: Any) -> None:
        body = document(("shapes", 0, "asset"), id, id)
        strict.http.put(linked, json=body, params=query, headers=anna).raise_for_status()

    def seen() -> int:
        return strict.http.get(f"/v1/assets/{id}", headers=BERT).status_code

    put(by_link=True)
    assert seen() == 404, "the hash of a file is no link"
    read = strict.http.get(linked, headers=BERT).raise_for_status().json()
    assert seen() == 200
    saved = strict.http.put("/v1/documents/scenes/copy", json=read, headers=BERT)
    assert saved.status_code == 201
    strict.http.delete("/v1/documents/scenes/copy", headers=BERT).raise_for_status()
    put(shared=False)
    assert seen() == 404, "the link leads nowhere"
    put(by_link=True)
    assert seen() == 404, "nobody has read it since"
    strict.http.delete(linked, headers=anna).raise_for_status()
