"""Bodies that ask about the BSDF of one material, checked. Textures are refused, as there is no surface."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from pydantic import Field, TypeAdapter

from service.document import Material, load_json
from service.document.base import Model
from service.document.material import MODELS
from service.document.numbers import Cosine, QuestionDirections
from service.document.texture import references
from service.document.validation import validated
from service.ipc.messages import BsdfQuestion
from service.pack.parameters import has_terms
from service.problems import FieldError, InvalidDocument, TooLarge

MOST_PAIRS = 1 << 16  # of one question
MOST_SAMPLES = 1 << 20  # of one direction
MOST_WORK = 1 << 24  # samples of one question, some seconds of two cores
WITH_TERMS = tuple(filter(has_terms, MODELS))  # models of microfacets


class BsdfBody(Model):
    """Directions are in the shading frame and are normalised: z is the normal, x the tangent; wo.z < 0 is inside."""

    material: Material
    wo: QuestionDirections
    wi: QuestionDirections
    lobes: bool = False


class AlbedoBody(Model):
    material: Material
    cosines: Annotated[list[Cosine], Field(min_length=1)]
    samples: Annotated[int, Field(ge=1, le=MOST_SAMPLES)] = 4096


class TermsBody(Model):
    material: Material
    cosines: Annotated[list[Cosine], Field(min_length=1)]
    wo_cosine: Cosine = math.sqrt(0.5)


_BSDF, _ALBEDO, _TERMS = TypeAdapter(BsdfBody), TypeAdapter(AlbedoBody), TypeAdapter(TermsBody)

_MATERIAL: TypeAdapter[Material] = TypeAdapter(Material)


@dataclass(frozen=True)
class BsdfRequest:
    """The question of an EvaluateBsdf. Directions (n, 3) and (m, 3) float64, unit length."""

    question: BsdfQuestion
    material: Material
    wo: np.ndarray
    wi: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    samples: int = 0
    lobes: bool = False


def parse_values(body: bytes | bytearray | memoryview) -> BsdfRequest:
    """Raises MalformedJson, InvalidDocument, TooLarge."""
    document = load_json(body)
    n, m = _length(document, "wo"), _length(document, "wi")
    if n * m > MOST_PAIRS:
        detail = f"{n} wo and {m} wi are {n * m} pairs: at most {MOST_PAIRS} are evaluated at a time"
        raise TooLarge(detail, "/wi" if m > n else "/wo")
    parsed = validated(_BSDF, document, "")
    _without_textures(parsed.material)
    wo, wi = normalized(parsed.wo), normalized(parsed.wi)
    return BsdfRequest("values", parsed.material, wo, wi, lobes=parsed.lobes)


def parse_albedo(body: bytes | bytearray | memoryview) -> BsdfRequest:
    """Raises MalformedJson, InvalidDocument, TooLarge."""
    parsed = validated(_ALBEDO, _with_few_cosines(body), "")
    _without_textures(parsed.material)
    work = len(parsed.cosines) * parsed.samples
    if work > MOST_WORK:
        detail = f"{len(parsed.cosines)} cosines of {parsed.samples} samples are {work}: at most {MOST_WORK}"
        raise TooLarge(detail, "/samples")
    return BsdfRequest("albedo", parsed.material, in_plane(parsed.cosines), samples=parsed.samples)


def parse_terms(body: bytes | bytearray | memoryview) -> BsdfRequest:
    """Raises MalformedJson, InvalidDocument, TooLarge."""
    parsed = validated(_TERMS, _with_few_cosines(body), "")
    _without_textures(parsed.material)
    if detail := without_terms(parsed.material):
        raise InvalidDocument([FieldError("/material/type", detail)])
    return BsdfRequest("terms", parsed.material, in_plane([parsed.wo_cosine]), in_plane(parsed.cosines))


def without_terms(material: Material) -> str:
    """Why it has neither distribution nor geometry nor Fresnel term; "" where it has."""
    if material.type in WITH_TERMS:
        return ""
    return f"{material.type!r} has no distribution, geometry and Fresnel term; {', '.join(WITH_TERMS)} have"


def normalized(directions: np.ndarray) -> np.ndarray:
    """Unit length, (n, 3) float64."""
    scaled = directions / np.abs(directions).max(axis=1, keepdims=True)
    out: np.ndarray = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
    return out


def in_plane(cosines: list[float]) -> np.ndarray:
    """Directions in the plane of normal and tangent, on the tangent's side, (n, 3) float64."""
    c = np.array(cosines, np.float64)
    return np.stack([np.sqrt((1 - c) * (1 + c)), np.zeros_like(c), c], axis=1)


def _with_few_cosines(body: bytes | bytearray | memoryview) -> Any:
    document = load_json(body)
    if (count := _length(document, "cosines")) > MOST_PAIRS:
        raise TooLarge(f"{count} cosines are too many: at most {MOST_PAIRS} are evaluated at a time", "/cosines")
    return document


def _length(document: Any, name: str) -> int:
    found = document.get(name) if isinstance(document, dict) else None
    return len(found) if isinstance(found, list) else 0


def parse_material(document: Any) -> Material:
    """A material without textures. Raises InvalidDocument."""
    material: Material = validated(_MATERIAL, document, "")
    _without_textures(material, "")
    return material


def _without_textures(material: Material, pointer: str = "/material") -> None:
    if textured := references(material):
        detail = "a texture has no value without a surface: give a number or a colour"
        raise InvalidDocument(FieldError(f"{pointer}/{name}", detail) for name in textured)
