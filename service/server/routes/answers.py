"""The shapes of answers for the API's description: models, statuses, and examples that work when pasted."""

from __future__ import annotations

import math
from datetime import datetime
from typing import Annotated, Any, Literal

from fastapi import Path
from pydantic import BaseModel, Field

from service.document import presets
from service.document.material import MODELS
from service.ipc.messages import Reason
from service.problems import ANSWERS
from service.server.renders.store.record import State
from service.server.requests.batch_request import MOST_AXES
from service.server.requests.bsdf_request import MOST_SAMPLES
from service.server.routes.examples import (
    ALBEDO,
    ANY_DOCUMENT,
    ASSET,
    ASSET_ID,
    BATCH,
    BSDF,
    CONVERSION,
    MATERIAL,
    RENDER,
    RENDER_ID,
    SCENE,
    TERMS,
)
from service.server.routes.request_fields import NAMED
from service.server.storage import documents

PROBLEM = {"$ref": "#/components/schemas/Problem"}
TITLES = {row.status: row.title for row in ANSWERS.values()}

DocumentKind = Annotated[str, Path(json_schema_extra={"enum": list(documents.KINDS)}, examples=["scenes"])]
PresetKind = Annotated[str, Path(json_schema_extra={"enum": list(presets.KINDS)}, examples=["scenes"])]
RenderId = Annotated[str, Path(description="As the answer to the render's start has it.", examples=[RENDER_ID])]
AssetId = Annotated[str, Path(description="`sha256:` and 64 hexadecimal digits.", examples=[ASSET_ID])]

Responses = dict[int | str, dict[str, Any]]


class FieldProblem(BaseModel):
    pointer: str = Field(description="RFC 6901, from the body's root; of a parameter its name.")
    detail: str


class Problem(BaseModel):
    """RFC 9457."""

    type: str
    title: str
    status: int
    detail: str
    errors: list[FieldProblem] = Field(default_factory=list)
    choices: list[str] = Field(default_factory=list, description="The models of a zip that holds several.")


class Named(BaseModel):
    name: str
    title: str


class NamedPreset(Named):
    kind: str | None = Field(
        None,
        description="Of a material: metal, plastic, glass, stone, cloth, organic, light; database: one of the "
        "Physically Based database.",
    )
    source: str | None = Field(None, description="Who measured a material's numbers, where they were measured.")
    group: str | None = Field(None, description="Of a scene: the part of a menu that it stands in, if not the first.")


class RendererSpec(BaseModel):
    id: str
    vendor: str | None = Field(description="As the device's driver says it; null while nothing renders there.")
    driver: str | None = Field(description="Its renderer and version; null until it has started.")
    device: str
    host: str
    state: str


class Memory(BaseModel):
    limit: int = Field(description="Bytes (SUNBOX_MEMORY).")
    used: dict[str, int] = Field(description="Bytes, by what is in it.")


class Formats(BaseModel):
    """Of files."""

    pictures: list[str] = Field(description="Are written.")
    animations: list[str] = Field(description="Are written.")
    meshes: list[str] = Field(description="Are read.")
    scenes: list[str] = Field(description="Are read as whole scenes.")
    images: list[str] = Field(description="Are read, for textures and environments.")
    luts: list[str] = Field(description="Are read as tables of colours, which `lut` names.")
    materials: list[str] = Field(description="Are read as materials.")
    exports: list[str] = Field(description="Are written from scenes, by `POST /v1/export`.")
    compressions: list[str] = Field(description="Are read inside glTF files.")
    missing: dict[str, str] = Field(description="Formats that this server lacks a package for, with its name.")


class Info(BaseModel):
    version: str
    renderer: dict[str, Any] | None = Field(
        description="What the first renderer's driver says; null: nothing renders."
    )
    renderers: list[RendererSpec]
    sandbox: dict[str, Any] = Field(description="What the processes that read uploads have given up.")
    memory: Memory
    limits: dict[str, Any] = Field(description="What may be sent, by the names of the settings.")
    quality: dict[str, Any] = Field(description="The quality presets, with what they cost.")
    formats: Formats
    tone_maps: list[str] = Field(description="By what pictures are shown; the short names come first.")


class Schemas(BaseModel):
    scene: dict[str, Any] = Field(description="JSON Schema.")
    settings: dict[str, Any] = Field(description="JSON Schema.")
    view: dict[str, Any] = Field(description="JSON Schema of the stream's message.")


class Kernel(BaseModel):
    raised: list[str] = Field(description="Features of the scene that the kernel was compiled with.")
    not_raised: list[str] = Field(description="Features that it was spared.")
    caustics: Literal["light", "paths"] | None = Field(
        None, description="Whether caustics are traced from the lights or found by the camera's paths."
    )
    compile_ms: float


class Forecast(BaseModel):
    samples: int
    seconds: float = Field(description="From the render's start, as this scene goes on this machine.")
    noise: float


class Render(BaseModel):
    id: str
    state: State
    label: str | None
    priority: int
    created: datetime | None = Field(description="When it was sent, by the server's clock; UTC.")
    started: datetime | None = Field(description="When it first left the line; null while it waits for that.")
    ended: datetime | None = Field(description="When it was done, cancelled or failed; null before.")
    reason: Reason | None
    samples: int = Field(description="Complete ones per pixel; with `adaptive` their mean over the pixels.")
    noise: float | None = Field(description="Estimated RMSE of the luminance over its mean; null before 2 samples.")
    elapsed_s: float = Field(description="From the first dispatch to the end of the last sample.")
    setup_s: float = Field(description="Loading, building and compiling before that.")
    kernel: Kernel | None = Field(None, description="With `kernel` only; null until the scene is loaded, too.")
    eta_s: float | None
    forecast: dict[str, Forecast] | None = Field(description="By quality preset; null until 16 samples tell.")
    warnings: list[str]
    renderers: int = Field(description="How many trace it now.")
    not_divided: str | None = Field(description="Why no more than one may; null where its settings allow it.")
    settings: dict[str, Any] = Field(description="What each knob became; null is no such limit.")


class StartedBatch(BaseModel):
    id: str
    renders: int


class BatchMember(BaseModel):
    id: str = Field(description="Of the render, known before its turn.")
    state: State


class Batch(BaseModel):
    id: str
    state: State = Field(description="`failed` where all renders failed.")
    label: str | None
    priority: int
    created: datetime = Field(description="When it was sent, by the server's clock; UTC.")
    counts: dict[State, int] = Field(description="Renders in each state.")
    renders: list[BatchMember] = Field(description="In their order: the last axis runs fastest.")
    eta_s: float | None = Field(description="As if no other renders waited; null until one of them has ended.")


class ConvertedMaterial(BaseModel):
    material: dict[str, Any]
    lost: list[str] = Field(description="Names of the given parameters that have no part in it.")


class SpecularLobe(BaseModel):
    wi: list[float]
    weight: list[float] = Field(description="What radiance is multiplied by, for each channel; without eta^2.")
    probability: float = Field(description="With which the renderer picks the lobe.")


class BsdfLobe(BaseModel):
    name: str = Field(
        description="`diffuse`, `specular`, `multiscatter`, `sheen`, `clearcoat` or `transmission`; the layers of "
        "`openpbr` are `fuzz` and `coat`."
    )
    f: list[list[list[float]]] = Field(description="Its part of `f`; 0 where the material's numbers turn it off.")


class BsdfValues(BaseModel):
    f: list[list[list[float]]] = Field(
        description="`f[i][j]` is the value for `wo[i]` and `wi[j]`, 1/sr, without the cosine: transmission where "
        "the z of the two differ in sign, as basic radiance, so that f over the square of the index on wi's side is "
        "symmetric. 0 behind a surface that does not transmit."
    )
    pdf: list[list[float]] = Field(
        description="The density of `wi[j]`, 1/sr. Its integral is 1, less the probabilities of specular lobes, less "
        "samples that are lost below the horizon."
    )
    delta: list[list[SpecularLobe]] = Field(description="The perfectly specular lobes as seen from `wo[i]`.")
    lobes: list[BsdfLobe] | None = Field(
        None,
        description="With `lobes` only: what the material's model adds up to `f`, which is their sum to rounding.",
    )


class BsdfTerms(BaseModel):
    distribution: list[float] | None = Field(
        description="The density of facets whose normal has this cosine, 1/sr; null for a perfect mirror."
    )
    geometry: list[float] | None = Field(
        description="The share of facets that is neither masked nor shadowed, between a direction of this cosine and "
        "one of `wo_cosine` on the other side of the normal; null for a perfect mirror."
    )
    fresnel: list[list[float]] = Field(description="The reflectance of a facet at this cosine.")


class BsdfAlbedo(BaseModel):
    albedo: list[list[float]] = Field(description="Of each cosine, for each channel.")
    error: list[list[float]] = Field(
        description="Its standard error. That of a single sample is the standard deviation of 64 others."
    )


def problems(*statuses: int) -> Responses:
    """The errors that a call may be answered with."""
    content = {"application/problem+json": {"schema": PROBLEM}}
    return {status: {"description": TITLES[status], "content": content} for status in statuses}


def shaped(model: Any, description: str = "", status: int = 200) -> Responses:
    return {status: {"model": model, "description": description or "It is."}}


def files(*mimes: str) -> Responses:
    binary = {"schema": {"type": "string", "format": "binary"}}
    return {200: {"description": "The file.", "content": {mime: binary for mime in mimes}}}


def body(schema: dict[str, Any], **examples: Any) -> dict[str, Any]:
    """`openapi_extra` of a call whose body is JSON."""
    named = {name: {"value": value} for name, value in examples.items()}
    content = {"application/json": {"schema": schema, "examples": named}}
    return {"requestBody": {"required": True, "content": content}}


def reference(name: str) -> dict[str, str]:
    return {"$ref": f"#/components/schemas/{name}"}


_ANY = {"application/json": {"schema": ANY_DOCUMENT}}
DOCUMENT: Responses = {200: {"description": "The document.", "content": _ANY}}
SCENE_DOCUMENT: Responses = {
    200: {"description": "The scene.", "content": {"application/json": {"schema": reference("Scene")}}}
}
RENDER_SCHEMA: dict[str, Any] = {
    "type": "object",
    "required": ["scene"],
    "additionalProperties": False,
    "properties": {"scene": reference("Scene"), "settings": reference("Settings")},
}
RENDER_BODY = body(RENDER_SCHEMA, sphere=RENDER)
RENDER_AGAIN: Responses = {
    200: {"description": "The body.", "content": {"application/json": {"schema": RENDER_SCHEMA}}}
}
LASTING_RENDER_BODY = body(RENDER_SCHEMA | {"properties": RENDER_SCHEMA["properties"] | NAMED}, sphere=RENDER)
_AXIS = {
    "anyOf": [reference("ValuesAxis"), reference("PatchesAxis"), reference("TurntableAxis"), reference("TimesAxis")],
    "description": "What varies along it.",
}
_OVER = {"type": "array", "minItems": 1, "maxItems": MOST_AXES, "items": _AXIS}
BATCH_BODY = body(
    {
        **RENDER_SCHEMA,
        "required": ["scene", "over"],
        "properties": RENDER_SCHEMA["properties"] | NAMED | {"over": _OVER},
    },
    roughness=BATCH,
)
EVENTS: Responses = {
    200: {"description": "The events.", "content": {"text/event-stream": {"schema": {"type": "string"}}}}
}
DOCUMENT_BODY = body(
    {"anyOf": [reference("Scene"), reference("Material"), reference("SavedMaterial")]},
    material=MATERIAL,
    scene=SCENE,
)
_DIRECTIONS = {
    "type": "array",
    "minItems": 1,
    "items": {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3},
    "description": "z is the normal, x the tangent; any length but 0. A `wo` with negative z is inside the body.",
}
BSDF_BODY = body(
    {
        "type": "object",
        "required": ["material", "wo", "wi"],
        "additionalProperties": False,
        "properties": {
            "material": reference("Material"),
            "wo": _DIRECTIONS,
            "wi": _DIRECTIONS,
            "lobes": {"type": "boolean", "default": False, "description": "Whether to answer with each lobe, too."},
        },
    },
    metal=BSDF,
)
_COSINE = {"type": "number", "exclusiveMinimum": 0, "maximum": 1}
_COSINES = {"type": "array", "minItems": 1, "items": _COSINE}
TERMS_BODY = body(
    {
        "type": "object",
        "required": ["material", "cosines"],
        "additionalProperties": False,
        "properties": {
            "material": reference("Material"),
            "cosines": _COSINES,
            "wo_cosine": _COSINE
            | {"default": math.sqrt(0.5), "description": "Of the other direction, for geometry."},
        },
    },
    metal=TERMS,
)
ALBEDO_BODY = body(
    {
        "type": "object",
        "required": ["material", "cosines"],
        "additionalProperties": False,
        "properties": {
            "material": reference("Material"),
            "cosines": _COSINES | {"description": "Between `wo` and the normal."},
            "samples": {"type": "integer", "minimum": 1, "maximum": MOST_SAMPLES, "default": 4096},
        },
    },
    metal=ALBEDO,
)
CONVERSION_BODY = body(
    {
        "type": "object",
        "required": ["material", "to"],
        "additionalProperties": False,
        "properties": {
            "material": reference("Material"),
            "to": {"type": "string", "enum": list(MODELS), "description": "The `type` of the model."},
            "choose": {
                "type": "object",
                "additionalProperties": {"type": "string"},
                "default": {},
                "description": "Values of menus of that model. Numbers that depend on one follow it: facets of "
                "another `distribution` have a peak as wide.",
            },
        },
    },
    metal=CONVERSION,
)
ASSET_BODY = {
    "requestBody": {
        "required": True,
        "content": {
            "application/octet-stream": {
                "schema": {"type": "string", "format": "binary"},
                "examples": {"triangle": {"value": ASSET}},
            },
        },
    }
}
