"""The numbers and textures of one material of a file, for meshes that show them alike."""

from __future__ import annotations

from service.formats.read.gltf.json_view import JsonView
from service.formats.read.gltf.textures import Charts, ColorSpace, Textures
from service.formats.read.scenes.warnings import Warnings
from service.formats.surface.gltf_members import ROUGH
from service.formats.surface.plain import Given


class MaterialReader:
    """One material for meshes that have these uv sets, and perhaps tangents."""

    def __init__(self, place: JsonView, textures: Textures, charts: Charts, directed: bool, notes: Warnings) -> None:
        self.place, self.textures, self.charts, self.directed, self.notes = place, textures, charts, directed, notes

    def owner(self, extension: str) -> JsonView | None:
        """The object that has the members of an extension; of "", the material itself."""
        if extension in ("", ROUGH):
            return self.place.object(ROUGH) if extension else self.place
        return self.place.extension(f"KHR_materials_{extension}")

    def texture(self, owner: JsonView, name: str, space: ColorSpace = "linear") -> str | None:
        return self.textures.use(owner.object(name), space, self.charts)

    def color(self, owner: JsonView, name: str, values: tuple[float, ...]) -> Given:
        """A colour, or the texture that it multiplies; black times a texture is black."""
        texture = self.texture(owner, name, "srgb") if max(values) else None
        return values if texture is None else {"texture": texture, "factor": list(values)}

    def scalar(self, owner: JsonView, name: str, value: float, channel: str, space: ColorSpace = "linear") -> Given:
        """A number, or the texture's channel that it multiplies; an image without alpha has 1 there."""
        info = owner.object(name) if value else None
        if info is None or (channel == "a" and "A" not in self.textures.channels(info)):
            return value
        texture = self.texture(owner, name, space)
        return value if texture is None else {"texture": texture, "channel": channel, "factor": value}

    def share(self, owner: JsonView, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """A colour within 0..1, perhaps with alpha."""
        found = owner.color(name, default)
        if max(found) > 1:
            self.notes.add(owner.at(name), "values above 1 are not supported; 1 is used instead")
        return tuple(min(value, 1.0) for value in found)
