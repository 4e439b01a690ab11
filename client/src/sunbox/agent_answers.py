"""Answers of the tools for agents: structured results, one picture of at most a megapixel, and mistakes."""

from __future__ import annotations

import base64
import json
import math
from io import BytesIO
from typing import Any

from mcp_types import CallToolResult, ContentBlock, ImageContent, TextContent
from PIL import Image
from pydantic import BaseModel, Field, ValidationError

from sunbox.errors import SunboxError

MOST_PIXELS = 1_000_000
QUALITY = 90  # of WebP: an agent sees no difference, and a picture takes a tenth of a PNG's bytes


class Problem(BaseModel):
    pointer: str = Field(
        description="JSON pointer (RFC 6901) into the tool's arguments; empty where no field is to blame."
    )
    detail: str


class RenderAnswer(BaseModel):
    render: str = Field(description="The render's id, which `compare` takes.")
    state: str = Field(description="done; or queued or running, where it takes long: the same call again goes on.")
    samples: int = Field(description="Per pixel.")
    noise: float | None = Field(description="Estimated RMSE of the luminance over its mean.")
    width: int
    height: int
    shown_width: int = Field(description="Of the picture that is shown, which is scaled down to a megapixel.")
    shown_height: int
    warnings: list[str]


class SheetPicture(BaseModel):
    value: Any
    render: str
    state: str


class SheetAnswer(BaseModel):
    batch: str
    state: str
    pictures: list[SheetPicture] = Field(description="In the order of the sheet: rows from the top, left to right.")


class SceneAnswer(BaseModel):
    scene: str = Field(description="The name of the saved scene, for `scene` of every tool.")


class Validity(BaseModel):
    valid: bool
    scene: str | None = Field(description="The name under which it is saved, where it is valid.")
    problems: list[Problem]


class Hit(BaseModel):
    shape: int = Field(description="Its index in `shapes`.")
    name: str | None
    material: str | None


class PixelAnswer(BaseModel):
    x: int
    y: int
    color: list[float] = Field(description="Linear r, g, b and alpha.")
    albedo: list[float]
    normal: list[float] = Field(description="World space.")
    depth: float | None = Field(description="Metres along the ray; null where nothing is hit.")
    hit: Hit | None = Field(description="What the ray meets first; null where it meets nothing.")


class Comparison(BaseModel):
    different: bool = Field(description="Whether they look different beyond noise.")
    p_value: float
    mean_difference: float | None = None
    rmse: float | None = None
    psnr: float | None = None
    flip: float | None = None
    ssim: float | None = None
    regions: list[dict[str, Any]] = Field(default=[], description="Where, in pixels.")


class NamedMaterial(BaseModel):
    name: str
    title: str
    kind: str | None = None
    saved: bool = Field(description="Whether a user saved it; else it is built in.")


class MaterialsAnswer(BaseModel):
    materials: list[NamedMaterial]
    more: int = Field(description="How many others fit the query.")
    document: dict[str, Any] | None = Field(description="Where the query is a material's name: what it is.")
    models: list[str] = Field(description="The models of materials: what `type` may be.")
    fields: dict[str, Any] | None = Field(description="Where the query is a model: its fields.")


class BsdfAnswer(BaseModel):
    f: list[list[list[float]]] = Field(description="f[i][j]: r, g, b for wo[i] and wi[j], 1/sr, without the cosine.")
    pdf: list[list[float]]
    delta: list[list[dict[str, Any]]] = Field(description="Perfectly specular lobes as seen from wo[i].")


class Mistake(Exception):
    """An argument is wrong."""

    def __init__(self, pointer: str, detail: str) -> None:
        super().__init__(detail)
        self.detail, self.errors = detail, [(pointer, detail)]


class ArgumentsRefused(Mistake):
    """Arguments do not have the types that the tool's schema says."""

    def __init__(self, error: ValidationError) -> None:
        super().__init__("", "The arguments do not fit the tool's schema.")
        errors = error.errors(include_url=False, include_input=False, include_context=False)
        # Of a union every alternative has complaints; behind the argument's name stand their names, and indices.
        found = {_pointer(each["loc"]): each["msg"] for each in reversed(errors)}
        self.errors = [(pointer, found[pointer]) for pointer in reversed(found)]


def _pointer(place: tuple[int | str, ...]) -> str:
    return "".join(f"/{step}" for step in (*place[:1], *(step for step in place[1:] if isinstance(step, int))))


def answered(answer: BaseModel, picture: ImageContent | None = None) -> CallToolResult:
    """The result and its picture. Its text is the same result as JSON, in which names stand quoted."""
    found = answer.model_dump(mode="json")
    content: list[ContentBlock] = [TextContent(type="text", text=json.dumps(found))]
    return CallToolResult(content=[*content, *([] if picture is None else [picture])], structured_content=found)


def refused(error: SunboxError | Mistake) -> CallToolResult:
    """A mistake, as JSON: what stands in it of a document is quoted."""
    found = {"detail": error.detail, "problems": [each.model_dump() for each in problems(error)]}
    if isinstance(error, SunboxError) and error.status is not None:
        found["status"] = error.status
    return CallToolResult(content=[TextContent(type="text", text=json.dumps({"error": found}))], is_error=True)


def problems(error: SunboxError | Mistake) -> list[Problem]:
    return [Problem(pointer=pointer, detail=detail) for pointer, detail in error.errors]


def in_arguments(error: SunboxError, place: str) -> SunboxError:
    """The error with pointers into a tool's arguments: those below `place` of what the tool sent begin there."""
    errors = [
        (pointer.removeprefix(place) if f"{pointer}/".startswith(f"{place}/") else pointer, detail)
        for pointer, detail in error.errors
    ]
    return type(error)(error.detail, error.status, errors, error.title)


def shown(file: bytes) -> tuple[ImageContent, int, int]:
    """A PNG as a picture of at most a megapixel, its width and height. Transparent parts are black."""
    with Image.open(BytesIO(file)) as opened:
        picture = opened.convert("RGBA")
    flat = Image.new("RGB", picture.size)
    flat.paste(picture, mask=picture.getchannel("A"))
    factor = math.sqrt(MOST_PIXELS / (flat.width * flat.height))
    if factor < 1:
        flat = flat.resize((max(1, int(flat.width * factor)), max(1, int(flat.height * factor))))
    written = BytesIO()
    flat.save(written, "WEBP", quality=QUALITY)
    data = base64.b64encode(written.getvalue()).decode()
    return ImageContent(type="image", data=data, mime_type="image/webp"), flat.width, flat.height
