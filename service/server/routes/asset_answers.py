"""What uploads are answered, for the API's description."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, Field

from service.formats.types import Kind
from service.server.routes.answers import Responses, reference
from service.server.routes.example_answers import UPLOADED


class AssetWarning(BaseModel):
    pointer: str = Field(
        description="The first place: RFC 6901 into the file's own JSON, or FILE:LINE of a zipped OBJ; may be empty."
    )
    detail: str
    count: int | None = Field(None, description="How many places; not there where the pointer is the only one.")


class AssetAnimation(BaseModel):
    name: str
    duration: float = Field(description="s; it begins at 0.")


class Asset(BaseModel):
    id: str
    kind: Kind
    format: str
    bytes: int
    width: int | None = Field(None, description="Of an image, texels.")
    height: int | None = Field(None, description="Of an image, texels.")
    channels: int | None = Field(None, description="Of an image.")
    vertices: int | None = Field(None, description="Of a mesh.")
    triangles: int | None = Field(None, description="Of a mesh or a scene.")
    bounds: list[list[float]] | None = Field(None, description="Of a mesh or a scene: least and greatest x, y, z, m.")
    warnings: list[AssetWarning] = Field(
        description="What is odd about the file, and what it asks for and does not get."
    )
    exposure: float | None = Field(
        None,
        description="Of a scene whose own lights expose the picture more than 4 stops from middle grey: the exposure "
        "in stops that suits them, metered from the logarithmic mean of the luminance in the camera's picture. "
        "Photometric lights, such as Blender exports, need about -10.",
    )
    aspect_ratio: float | None = Field(
        None, description="Of a scene whose camera says it: the width of its picture over the height."
    )
    variants: list[str] | None = Field(None, description="Of a scene: the variants of its materials, by name.")
    animations: list[AssetAnimation] | None = Field(None, description="Of a scene.")


class MaterialSet(BaseModel):
    materials: dict[str, Any]
    textures: dict[str, Any] = Field(description="All that the materials show, by name.")
    warnings: list[AssetWarning] = Field(description="Which of its images are not used, and why.")


ASSET_FILE: Responses = {
    200: {
        "description": "The file, or what it is.",
        "content": {
            "application/octet-stream": {"schema": {"type": "string", "format": "binary"}},
            "application/json": {"schema": reference("Asset"), "example": UPLOADED},
        },
    }
}
