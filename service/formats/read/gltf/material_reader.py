"""The numbers and textures of one material of a file, each read once for the meshes that use it."""

from __future__ import annotations

from typing import Any

from service.formats.read.gltf.json_view import JsonView
from service.formats.read.gltf.textures import Chart, ColorSpace, Textures, factor
from service.formats.read.scenes.warnings import Warnings


class MaterialReader:
    """One material for meshes that have these uv sets, and perhaps tangents."""

    def __init__(
        self, place: JsonView, textures: Textures, charts: tuple[Chart | None, ...], directed: bool, notes: Warnings
    ) -> None:
        self.place, self.textures, self.charts, self.directed, self.notes = place, textures, charts, directed, notes

    def texture(self, owner: JsonView | None, name: str, space: ColorSpace) -> str | None:
        return self.textures.use(owner.object(name), space, self.charts) if owner else None

    def color(self, owner: JsonView, name: str, values: tuple[float, ...]) -> Any:
        """A colour, or the texture that it multiplies; black times a texture is black."""
        if not max(values):
            return 0.0
        texture = self.texture(owner, name, "srgb")
        return factor(values) if texture is None else {"texture": texture, "factor": factor(values)}

    def share(self, owner: JsonView, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """A colour within 0..1, perhaps with alpha."""
        found = owner.color(name, default)
        if max(found) > 1:
            self.notes.add(owner.at(name), "values above 1 are not supported; 1 is used instead")
        return tuple(min(value, 1.0) for value in found)

    def scalar(self, owner: JsonView, name: str, value: float, channel: str, space: ColorSpace = "linear") -> Any:
        """A number, or the texture's channel that it multiplies; an image without alpha has 1 there."""
        info = owner.object(name)
        if not value:
            return 0.0
        if channel == "a" and info is not None and "A" not in self.textures.channels(info):
            return value
        texture = self.texture(owner, name, space)
        return value if texture is None else {"texture": texture, "channel": channel, "factor": value}
