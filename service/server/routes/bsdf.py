"""Values of a material's BSDF, from the functions that render."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from fastapi import APIRouter, Request, Response

from service.ipc.messages import EvaluateBsdf, SceneData
from service.pack import pack_material
from service.server.requests.bsdf_request import MOST_PAIRS, MOST_WORK, BsdfRequest
from service.server.requests.parsers import Kind
from service.server.routes import answers
from service.server.routes.errors import GONE
from service.server.routes.waiting import until
from service.server.state import STARTING_S, app_state, caller_of, owner_of
from service.system.executors import packing

router = APIRouter(prefix="/v1/bsdf", tags=["materials"])

AT_ONCE = 1 << 12  # numbers that are encoded at once, in a few milliseconds
PIECE = 1 << 10  # numbers that are encoded before other requests get a turn
LOBES_PIECE = PIECE // 16  # the same for specular lobes, in directions

Arrays = dict[str, np.ndarray]


@router.post(
    "",
    summary="Values of a material's BSDF",
    description="For any material without textures: `f` for every pair of directions, the density with which the "
    "renderer would sample `wi`, and the perfectly specular lobes, which are in neither. Opacity, emission, ambient "
    "light and absorption are left out. With `lobes`, each lobe of the model by itself as well. "
    f"At most {MOST_PAIRS} pairs.",
    openapi_extra=answers.BSDF_BODY,
    response_class=Response,
    responses=answers.shaped(answers.BsdfValues) | answers.problems(400, 413, 415, 422, 429, 503),
)
async def values(request: Request) -> Response:
    return await _answer(request, "bsdf", _values)


@router.post(
    "/albedo",
    summary="Directional albedo of a material",
    description="The share of the light from one direction that is reflected or transmitted, perfectly specular "
    "lobes included, by sampling as the renderer does. `wo` lies in the plane of normal and tangent. At most "
    f"{MOST_WORK} samples, over all cosines.",
    openapi_extra=answers.ALBEDO_BODY,
    response_class=Response,
    responses=answers.shaped(answers.BsdfAlbedo) | answers.problems(400, 413, 415, 422, 429, 503),
)
async def albedo(request: Request) -> Response:
    return await _answer(request, "albedo", _albedo)


@router.post(
    "/terms",
    summary="Distribution, geometry and Fresnel term of a material",
    description="Of models of microfacets, at the cosines of angles to the normal in the plane of normal and "
    f"tangent. Other models are refused. At most {MOST_PAIRS} cosines.",
    openapi_extra=answers.TERMS_BODY,
    response_class=Response,
    responses=answers.shaped(answers.BsdfTerms) | answers.problems(400, 413, 415, 422, 429, 503),
)
async def terms(request: Request) -> Response:
    return await _answer(request, "terms", _terms)


async def _answer(request: Request, kind: Kind, write: Callable[[Arrays], bytes]) -> Response:
    state, caller, owner = app_state(request), caller_of(request), owner_of(request)

    async def ready(body: bytearray) -> None:
        await state.renderers.able(STARTING_S)

    asked: BsdfRequest
    async with state.bodies.read(request, kind, caller, ready) as asked:
        if getattr(asked.material, "asset", None) is None:
            material: SceneData = pack_material(asked.material)
        else:  # a file has to be read
            material = await packing(partial(state.reader.pack_material, asked.material, owner=owner))
        question = EvaluateBsdf(0, asked.question, material, asked.wo, asked.wi, asked.samples, asked.lobes, owner)
        answer = asyncio.ensure_future(state.bsdf.ask(question, caller))
        if not await until(request, answer):
            return Response(status_code=GONE)
    arrays = answer.result()
    few = sum(array.size for array in arrays.values()) <= AT_ONCE
    return Response(write(arrays) if few else await packing(partial(write, arrays)), media_type="application/json")


def _values(arrays: Arrays) -> bytes:
    parts = {"f": _rows(arrays["f"]), "pdf": _rows(arrays["pdf"]), "delta": _deltas(arrays)}
    if len(arrays["lobes"]):
        named = zip(arrays["lobe_names"].tolist(), arrays["lobes"], strict=True)
        each = (f'{{"name":{json.dumps(name)},"f":{_rows(f)}}}' for name, f in named)
        parts["lobes"] = "[" + ",".join(each) + "]"
    return _object(parts)


def _deltas(arrays: Arrays) -> str:
    """The specular lobes of each `wo`, written in pieces."""
    names = ("delta_wi", "delta_weight", "delta_probability")
    pieces = []
    for at in range(0, len(arrays["delta_wi"]), LOBES_PIECE):
        wi, weight, probability = (_numbers(arrays[name][at : at + LOBES_PIECE]) for name in names)
        rows = [
            [{"wi": wi, "weight": weight, "probability": p} for wi, weight, p in zip(*row, strict=True) if p > 0]
            for row in zip(wi, weight, probability, strict=True)
        ]
        pieces.append(json.dumps(rows, allow_nan=False)[1:-1])
    return "[" + ",".join(pieces) + "]"


def _albedo(arrays: Arrays) -> bytes:
    return _object({"albedo": _pieces(arrays["albedo"]), "error": _pieces(arrays["error"])})


def _terms(arrays: Arrays) -> bytes:
    parts = {name: _pieces(arrays[name]) for name in ("distribution", "geometry", "fresnel")}
    if not arrays["has_facets"].all():
        parts |= {"distribution": "null", "geometry": "null"}
    return _object(parts)


def _object(members: dict[str, str]) -> bytes:
    return ("{" + ",".join(f'"{name}":{text}' for name, text in members.items()) + "}").encode()


def _rows(array: np.ndarray) -> str:
    return "[" + ",".join(map(_pieces, array)) + "]"


def _pieces(array: np.ndarray) -> str:
    """JSON of an array; the encoder, which is written in C, gives way now and then."""
    parts = (_numbers(array[at : at + PIECE]) for at in range(0, len(array), PIECE))
    return "[" + ",".join(json.dumps(part, allow_nan=False)[1:-1] for part in parts) + "]"


def _numbers(array: np.ndarray) -> Any:
    """Lists of numbers with the digits that tell a value in single precision from its neighbours; no -0."""
    if array.dtype == np.float32:
        array = np.array([float(str(x)) for x in array.ravel()]).reshape(array.shape)
    return (array + 0.0).tolist()
