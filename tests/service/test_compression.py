"""Which answers go out compressed."""

from __future__ import annotations

import pytest

from tests.serving import SCENE, SMALL, Server

GZIP = {"accept-encoding": "gzip"}
PUBLIC = ["/", "/main.js", "/style.css", "/openapi.json", "/v1/schema", "/v1/presets/scenes/cornell-boxes"]


@pytest.mark.parametrize("path", PUBLIC)
def test_public_text_is_compressed(server: Server, path: str) -> None:
    plain = server.http.get(path, headers={"accept-encoding": "identity"})
    packed = server.http.get(path, headers=GZIP)
    assert packed.headers["content-encoding"] == "gzip" and "Accept-Encoding" in packed.headers["vary"]
    assert packed.content == plain.content and "content-encoding" not in plain.headers
    assert int(packed.headers["content-length"]) < 0.5 * len(plain.content)


def test_what_is_somebodys_is_not(server: Server) -> None:
    made = server.http.post("/v1/renders?wait=60", json={"scene": SCENE, "settings": SMALL}, headers=GZIP)
    path = f"/v1/renders/{made.json()['id']}"
    for own in (
        path,
        f"{path}/image?format=png",
        f"{path}/image?format=npy",
        f"{path}/scene",
        "/v1/info",
        "/metrics",
    ):
        answer = server.http.get(own, headers=GZIP)
        assert answer.status_code == 200 and "content-encoding" not in answer.headers, own
    assert "content-encoding" not in made.headers


def test_what_somebody_saved_is_not(server: Server) -> None:
    address, scene = "/v1/documents/scenes/long", {**SCENE, "shapes": SCENE["shapes"] * 9}
    server.http.put(address, json=scene).raise_for_status()
    answer = server.http.get(address, headers=GZIP)
    server.http.delete(address).raise_for_status()
    assert len(answer.content) > 500, "shorter answers are never compressed"
    assert answer.json() == scene and "content-encoding" not in answer.headers


def test_unchanged_files_are_not_sent_again(server: Server) -> None:
    first = server.http.get("/main.js", headers=GZIP)
    again = server.http.get("/main.js", headers={**GZIP, "if-none-match": first.headers["etag"]})
    assert again.status_code == 304 and not again.content
