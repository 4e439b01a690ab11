"""openapi.json: what FastAPI knows of the routes, with the schemas of documents and the form of every refusal."""

from __future__ import annotations

from functools import partial
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic.json_schema import models_json_schema

from service import scene
from service.routes.answers import PROBLEM, Problem

HERE, THERE = "#/$defs/", "#/components/schemas/"


def describe(app: FastAPI, keyed: bool) -> None:
    """Make `app` describe itself; `keyed`: calls need a key."""
    app.openapi = partial(_described, app, keyed)  # type: ignore[method-assign]


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
        for call in calls.values():
            answers = call["responses"]
            if "HTTPValidationError" in str(answers.get("422")):
                answers["422"] = {"description": "A parameter is not valid", **_problem()}
            answers.setdefault("default", {"description": "Any other refusal", **_problem()})
            if keyed and path.startswith("/v1/"):
                call["security"] = [{"key": []}]
                answers.setdefault("401", {"description": "Key required", **_problem()})
    if keyed:
        found["components"]["securitySchemes"] = {"key": {"type": "http", "scheme": "bearer"}}
    app.openapi_schema = found
    return found


def _problem() -> dict[str, Any]:
    return {"content": {"application/problem+json": {"schema": PROBLEM}}}


def _documents() -> dict[str, Any]:
    """Scene, Settings and what they are made of."""
    out: dict[str, Any] = {}
    for name, schema in scene.schema().items():
        bare = {key: value for key, value in schema.items() if key not in ("$defs", "$schema")}
        out |= schema.get("$defs", {}) | {name.capitalize(): bare}
    kinds = [name for name in out if name.endswith("Material")]
    out["Material"] = {"oneOf": [{"$ref": HERE + name} for name in sorted(kinds)]}
    moved: dict[str, Any] = _moved(out)
    return moved


def _moved(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _moved(child) for key, child in value.items()}
    if isinstance(value, list):
        return [_moved(child) for child in value]
    return value.replace(HERE, THERE) if isinstance(value, str) and value.startswith(HERE) else value
