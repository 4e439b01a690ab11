"""openapi.json: FastAPI's description of the routes, with the schemas of documents and of every refusal."""

from __future__ import annotations

import inspect
from functools import cache, partial
from typing import Any

from fastapi import FastAPI, Request, Response
from fastapi.openapi.utils import get_openapi
from pydantic.json_schema import models_json_schema

from service import document
from service.document import axes
from service.server.http.compression import Constant
from service.server.routes import examples
from service.server.routes.answers import PROBLEM, Problem
from service.system.executors import answering

HERE, THERE = "#/$defs/", "#/components/schemas/"

# Operation ids: generated clients name their functions by them.
NAMES = {
    "GET /healthz": "isAlive",
    "GET /readyz": "isReady",
    "GET /metrics": "getMetrics",
    "GET /v1/info": "getInfo",
    "GET /v1/schema": "getSchema",
    "GET /v1/presets/{kind}": "listPresets",
    "GET /v1/presets/{kind}/{name}": "getPreset",
    "POST /v1/assets": "uploadAsset",
    "GET /v1/assets/{id}": "downloadAsset",
    "GET /v1/assets/{id}/scene": "getAssetScene",
    "GET /v1/assets/{id}/materials": "getAssetMaterials",
    "GET /v1/documents/{kind}": "listDocuments",
    "GET /v1/documents/{kind}/{name}": "getDocument",
    "PUT /v1/documents/{kind}/{name}": "saveDocument",
    "DELETE /v1/documents/{kind}/{name}": "deleteDocument",
    "POST /v1/render": "render",
    "POST /v1/renders": "startRender",
    "GET /v1/renders": "listRenders",
    "GET /v1/renders/events": "followRenders",
    "GET /v1/renders/{id}": "getRender",
    "DELETE /v1/renders/{id}": "deleteRender",
    "GET /v1/renders/{id}/events": "followRender",
    "GET /v1/renders/{id}/scene": "getRenderScene",
    "GET /v1/renders/{id}/image": "getRenderImage",
    "POST /v1/batches": "startBatch",
    "GET /v1/batches/{id}": "getBatch",
    "DELETE /v1/batches/{id}": "deleteBatch",
    "GET /v1/batches/{id}/images.zip": "downloadBatch",
    "GET /v1/batches/{id}/sheet": "getBatchSheet",
    "GET /v1/batches/{id}/animation": "getBatchAnimation",
    "GET /v1/callbacks": "listCallbacks",
    "POST /v1/compare": "compare",
    "GET /v1/compare/{name}": "getComparison",
    "POST /v1/export": "exportScene",
    "POST /v1/materials/convert": "convertMaterial",
    "POST /v1/bsdf": "evaluateBsdf",
    "POST /v1/bsdf/albedo": "getBsdfAlbedo",
    "POST /v1/bsdf/terms": "getBsdfTerms",
}
OF_FILE, WRITTEN_OUT = ("asset",), ("vertices", "faces", "normals", "uvs", "colors")  # what a mesh has, either or


def describe(app: FastAPI, keyed: bool) -> None:
    """Make `app` serve this description; `keyed`: calls need a key."""
    app.openapi = partial(_described, app, keyed)  # type: ignore[method-assign]
    written = cache(lambda: Constant(app.openapi()))

    async def description(request: Request) -> Response:
        return (await answering(written)).answer(request)

    app.add_api_route("/openapi.json", description, include_in_schema=False)


def _described(app: FastAPI, keyed: bool) -> dict[str, Any]:
    if app.openapi_schema:
        return app.openapi_schema
    found = get_openapi(title=app.title, version=app.version, description=app.description, routes=app.routes)
    schemas = found.setdefault("components", {}).setdefault("schemas", {})
    for name in ("HTTPValidationError", "ValidationError"):
        schemas.pop(name, None)
    _, defined = models_json_schema([(Problem, "serialization")], ref_template=THERE + "{model}")
    schemas |= defined["$defs"] | _documents()
    for path, calls in found["paths"].items():
        for method, call in calls.items():
            call["operationId"] = NAMES.get(f"{method.upper()} {path}", call["operationId"])
            answers = call["responses"]
            if "HTTPValidationError" in str(answers.get("422")):
                answers["422"] = {"description": "A parameter is not valid", **_problem()}
            _show(call)
            answers.setdefault("default", {"description": "Any other refusal", **_problem()})
            if keyed and path.startswith("/v1/"):
                call["security"] = [{"key": []}]
                answers.setdefault("401", {"description": "Key required", **_problem()})
    if keyed:
        found["components"]["securitySchemes"] = {"key": {"type": "http", "scheme": "bearer"}}
    app.openapi_schema = found
    return found


def _show(call: dict[str, Any]) -> None:
    """Put an example beside each answer that is text. A shape without a name has FastAPI's title, by which generated
    clients would name a type: it is left out."""
    for status, answer in call["responses"].items():
        shown = examples.answer(call["operationId"], status) if status.startswith("2") else None
        for content in answer.get("content", {}).values():
            if content["schema"].get("title", "").startswith("Response "):
                del content["schema"]["title"]
            if shown is not None:
                content["example"] = shown


def _problem() -> dict[str, Any]:
    return {"content": {"application/problem+json": {"schema": PROBLEM}}}


def _documents() -> dict[str, Any]:
    """Scene, Settings and what they are made of."""
    out: dict[str, Any] = {}
    for name, schema in document.schema().items():
        bare = {key: value for key, value in schema.items() if key not in ("$defs", "$schema")}
        out |= schema.get("$defs", {}) | {name.capitalize(): bare}
    kinds = [name for name in out if name.endswith("Material")]
    out["Material"] = {"oneOf": [{"$ref": HERE + name} for name in sorted(kinds)]}
    out["SavedMaterial"] = {
        "title": "SavedMaterial",
        "description": inspect.getdoc(document.SavedMaterial),
        "type": "object",
        "required": ["materials"],
        "additionalProperties": False,
        "properties": {
            "materials": {
                "type": "object",
                "minProperties": 1,
                "maxProperties": 1,
                "additionalProperties": {"$ref": HERE + "Material"},
            },
            "textures": out["Scene"]["properties"]["textures"],
        },
    }
    out |= _meshes(out["MeshShape"]) | _axes()
    # A word of a discriminator names one object. "mesh" stands for two; each has its `type` as a constant anyway.
    del out["Scene"]["properties"]["shapes"]["items"]["discriminator"]
    moved: dict[str, Any] = _moved(out)
    return moved


def _axes() -> dict[str, Any]:
    """What varies along the axes of a batch."""
    kinds = [(kind, "validation") for kind in (axes.Values, axes.Patches, axes.Turntable, axes.Times)]
    _, defined = models_json_schema(kinds, ref_template=HERE + "{model}")  # type: ignore[arg-type]
    axis = {f"{name}Axis": schema | {"title": f"{name}Axis"} for name, schema in defined["$defs"].items()}
    return axis


def _meshes(schema: dict[str, Any]) -> dict[str, Any]:
    """A mesh as two models: of alternatives that only say what is required, generators make no model."""
    common = {
        name: value for name, value in schema.items() if name not in ("oneOf", "properties", "required", "title")
    }
    models = {}
    for title, required, left_out in (
        ("FileMeshShape", ["asset"], WRITTEN_OUT),
        ("WrittenMeshShape", ["vertices", "faces"], OF_FILE),
    ):
        properties = {name: value for name, value in schema["properties"].items() if name not in left_out}
        required = [*schema["required"], *required]
        models[title] = {**common, "title": title, "properties": properties, "required": required}
    return models | {"MeshShape": {"oneOf": [{"$ref": HERE + title} for title in models]}}


def _moved(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _moved(child) for key, child in value.items()}
    if isinstance(value, list):
        return [_moved(child) for child in value]
    return value.replace(HERE, THERE) if isinstance(value, str) and value.startswith(HERE) else value
