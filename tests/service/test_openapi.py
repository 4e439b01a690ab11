"""The description of the API is true: its examples work when pasted, and every call is in it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import httpx
import jsonschema_rs
import pytest

from service.document import MeshShape
from service.server.routes.answers import Info, Schemas
from service.server.routes.description import NAMES
from tests.serving import Server


@pytest.fixture(scope="module")
def description(server: Server) -> Any:
    return server.http.get("/openapi.json").json()


def test_every_call_is_described(description: Any) -> None:
    calls = {f"{method.upper()} {path}" for path, methods in description["paths"].items() for method in methods}
    assert {
        "GET /healthz",
        "GET /readyz",
        "GET /v1/info",
        "GET /v1/schema",
        "GET /v1/presets/{kind}",
        "GET /v1/presets/{kind}/{name}",
        "POST /v1/assets",
        "GET /v1/assets/{id}",
        "GET /v1/documents/{kind}",
        "GET /v1/documents/{kind}/{name}",
        "PUT /v1/documents/{kind}/{name}",
        "DELETE /v1/documents/{kind}/{name}",
        "POST /v1/renders",
        "GET /v1/renders",
        "GET /v1/renders/{id}",
        "GET /v1/renders/{id}/image",
        "DELETE /v1/renders/{id}",
        "POST /v1/render",
        "POST /v1/bsdf",
        "POST /v1/bsdf/albedo",
        "POST /v1/bsdf/terms",
    } <= calls
    for methods in description["paths"].values():
        for call in methods.values():
            assert call["summary"] and "application/problem+json" in call["responses"]["default"]["content"]


def test_every_reference_leads_somewhere(description: Any) -> None:
    def check(value: Any) -> None:
        if isinstance(value, dict):
            if isinstance(value.get("$ref"), str):
                at = description
                for step in value["$ref"].removeprefix("#/").split("/"):
                    at = at[step]
            for child in value.values():
                check(child)
        elif isinstance(value, list):
            for child in value:
                check(child)

    check(description)
    schemas = description["components"]["schemas"]
    assert {"Scene", "Settings", "Material", "Problem", "Render"} <= schemas.keys()
    assert "HTTPValidationError" not in str(description)


def test_examples_work_when_pasted(server: Server, description: Any) -> None:
    sent = 0
    for path, methods in description["paths"].items():
        for method, call in methods.items():
            for mime, content in call.get("requestBody", {}).get("content", {}).items():
                for name, example in content.get("examples", {}).items():
                    address = path.replace("{kind}", f"{name}s").replace("{name}", "example")
                    answer = send(server.http, method, address, mime, example["value"])
                    assert answer.status_code in (200, 201, 202), (path, name, answer.text)
                    sent += 1
    assert sent >= 5
    for kind in ("scenes", "materials"):
        server.http.delete(f"/v1/documents/{kind}/example")


def test_every_operation_has_an_example(description: Any) -> None:
    """Of its body, of what stands in its path, and of each answer that is text: one that its shape allows."""
    components = {"components": description["components"]}
    shown = 0
    for path, methods in description["paths"].items():
        for method, call in methods.items():
            for parameter in call.get("parameters", []):
                if parameter["in"] == "path":
                    assert "example" in parameter or parameter["schema"].get("examples"), (path, parameter["name"])
            for content in call.get("requestBody", {}).get("content", {}).values():
                assert content["examples"], (method, path)
            for status, answer in call["responses"].items():
                for mime, content in answer.get("content", {}).items() if status.startswith("2") else ():
                    if content["schema"].get("format") == "binary":
                        continue
                    assert "example" in content, (method, path, status, mime)
                    checks = jsonschema_rs.validator_for(_closed(components | content["schema"]))
                    assert not list(checks.iter_errors(content["example"])), (method, path, status)
                    shown += 1
    assert shown > 20


def _closed(schema: Any) -> Any:
    """With models that allow no member but theirs: an example that has a member too many tells of what is no more."""
    if isinstance(schema, list):
        return [_closed(each) for each in schema]
    if not isinstance(schema, dict):
        return schema
    closed = {name: _closed(child) for name, child in schema.items()}
    if isinstance(closed.get("properties"), dict):
        closed.setdefault("additionalProperties", False)
    return closed


def send(http: httpx.Client, method: str, address: str, mime: str, value: Any) -> httpx.Response:
    if mime == "application/json":
        return http.request(method, address, json=value)
    return http.request(method, address, content=value, headers={"content-type": mime})


def test_answers_have_the_described_shape(server: Server, description: Any) -> None:
    """Every field of a render's status is described, and none is missing."""
    example = description["paths"]["/v1/renders"]["post"]["requestBody"]["content"]["application/json"]["examples"]
    status = server.http.post("/v1/renders", json=example["sphere"]["value"]).json()
    described = description["components"]["schemas"]["Render"]
    assert status.keys() == described["properties"].keys() - {"kernel"} == set(described["required"])
    whole = server.http.get(f"/v1/renders/{status['id']}", params={"kernel": "true"}).json()
    assert whole.keys() == described["properties"].keys()
    server.http.delete(f"/v1/renders/{status['id']}")


def test_every_call_has_a_name_for_programs(description: Any) -> None:
    ids = {
        f"{method.upper()} {path}": call["operationId"]
        for path, methods in description["paths"].items()
        for method, call in methods.items()
    }
    assert ids == NAMES and len(set(ids.values())) == len(ids)


def test_a_mesh_is_two_models(description: Any) -> None:
    """And between them they describe all that one may have."""
    schemas = description["components"]["schemas"]
    models = [schemas[each["$ref"].rpartition("/")[2]] for each in schemas["MeshShape"]["oneOf"]]
    assert not any("oneOf" in model for model in models)
    both = [set(model["properties"]) for model in models]
    assert both[0] | both[1] == set(MeshShape.model_fields)
    assert both[0] - both[1] == {"asset"} and {"vertices", "faces"} <= both[1] - both[0]
    for model in models:
        assert set(model["required"]) <= set(model["properties"]) and model["additionalProperties"] is False


def test_a_discriminator_names_objects(description: Any) -> None:
    """Not a union: generators have no one model then to choose."""
    schemas = description["components"]["schemas"]
    found = [each for each in _objects(description) if "mapping" in each.get("discriminator", ())]
    assert found
    for each in found:
        for reference in each["discriminator"]["mapping"].values():
            assert schemas[reference.rpartition("/")[2]]["type"] == "object", reference


def _objects(value: Any) -> Iterator[dict[str, Any]]:
    if isinstance(value, dict):
        yield value
    for child in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        yield from _objects(child)


def test_information_has_the_described_shape(server: Server, description: Any) -> None:
    for path, model in (("/v1/info", Info), ("/v1/schema", Schemas)):
        answer = description["paths"][path]["get"]["responses"]["200"]["content"]["application/json"]
        assert answer["schema"]["$ref"].endswith(f"/{model.__name__}")
        body = server.http.get(path).json()
        model.model_validate(body)
        assert body.keys() == model.model_fields.keys()


def test_an_upload_has_one_type_of_content(description: Any) -> None:
    content = description["paths"]["/v1/assets"]["post"]["requestBody"]["content"]
    assert list(content) == ["application/octet-stream"]
