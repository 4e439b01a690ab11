"""A material's model in few words, for prompts."""

from __future__ import annotations

import json

import pytest

from service.document.material import MODELS
from tests.serving import Server

LETTERS_OF_A_TOKEN = 3.0  # of JSON in English: 3.5 to 4 were counted with common tokenizers


@pytest.mark.parametrize("model", sorted(MODELS))
def test_each_field_has_a_line(server: Server, model: str) -> None:
    whole = server.http.get("/v1/schema", params={"model": model}).raise_for_status().json()
    answer = server.http.get("/v1/schema", params={"model": model, "brief": "true"}).raise_for_status()
    brief = answer.json()
    assert brief["type"] == model and brief["fields"].keys() == whole["properties"].keys() - {"type"}
    assert all(field["is"] and field["about"] and "\n" not in field["about"] for field in brief["fields"].values())
    assert len(answer.text) / LETTERS_OF_A_TOKEN < 4000
    for name in whole["$defs"]:
        assert f"#/$defs/{name}" in json.dumps(whole)


def test_ranges_units_and_defaults(server: Server) -> None:
    fields = server.http.get("/v1/schema?model=principled&brief=true").json()["fields"]
    assert fields["roughness"]["range"] == [0, 1] and fields["roughness"]["default"] == 0.5
    assert "texture" in fields["base_color"]["is"] and "colour" in fields["base_color"]["is"]
    assert any("unit" in field for field in fields.values())


@pytest.mark.parametrize(("query", "pointer"), [("model=gold", "/model"), ("brief=true", "/brief"), ("x=1", "/x")])
def test_mistakes(server: Server, query: str, pointer: str) -> None:
    answer = server.http.get(f"/v1/schema?{query}")
    assert answer.status_code == 422 and answer.json()["errors"][0]["pointer"] == pointer
