"""Materials of a library as the contract's."""

from __future__ import annotations

from typing import Any

from service.formats.read.obj.libraries import without_comment
from service.formats.read.obj.mtl import Map, MtlMaterial
from service.formats.read.obj.textures import Textures
from service.formats.read.scenes.names import unique
from service.formats.read.scenes.plain_mesh import GREY, NAME
from service.formats.read.scenes.warnings import Warnings
from service.formats.surface import wavefront
from service.formats.surface.plain import Default, Given, PlainInputs
from service.formats.types import BRIGHTEST

RELIEF = 0.01  # of the model's size
MAPS = {name: f"map_{name}" for name in ("kd", "ks", "ke", "d", "pr", "pm", "ps", "pc", "pcr")}


class Materials:
    """The materials that faces use; `documents` are the finished ones by name."""

    def __init__(
        self, library: dict[str, MtlMaterial], textures: Textures, has_uvs: bool, size: float, notes: Warnings
    ) -> None:
        """`has_uvs`: whether the mesh has texture coordinates, without which no texture is used. `size` is its
        greatest extent."""
        self.library, self.textures, self.has_uvs, self.notes = library, textures, has_uvs, notes
        self.relief = float(f"{RELIEF * size:.2g}")  # metres from black to white where a library does not say
        self.documents: dict[str, dict[str, Any]] = {}

    def add(self, name: str, place: str) -> str:
        """The document's name for the material that `usemtl` calls `name`."""
        material = self.library.get(name) or self.library.get(without_comment(name))
        if material is None and name:
            self.notes.add(place, f"the material {name[:80]!r} is not defined; a grey one is shown in its place")
        found = unique(name or NAME, self.documents)
        self.documents[found] = dict(GREY) if material is None else _document(self, material)
        return found

    def map(self, material: MtlMaterial, keyword: str) -> Map | None:
        """A map that the mesh can show."""
        found = material.maps.get(keyword)
        found = found and self.textures.chosen(found)
        if found is not None and not self.has_uvs:
            self.notes.add(found.place, "the mesh has no texture coordinates; it is shown without its textures")
            return None
        return found


def _document(owner: Materials, material: MtlMaterial) -> dict[str, Any]:
    inputs = _Inputs(owner, material)
    wavefront.wavefront(inputs)
    inputs.miss_ambient()
    return inputs.material | _Relief(owner, material).document()


class _Inputs(PlainInputs):
    """One material. Every number is read once, and its map with it."""

    def __init__(self, owner: Materials, material: MtlMaterial) -> None:
        super().__init__(wavefront.DEFAULTS)
        self.owner, self.mtl, self.notes = owner, material, owner.notes

    def given(self, name: str, default: Default) -> Given | None:
        """A number or a colour, or the texture that it multiplies; 0, which would hide the texture, counts as 1."""
        found = self.owner.map(self.mtl, MAPS.get(name, ""))
        is_color = isinstance(default, tuple)
        channel = "" if found is None or is_color else self.owner.textures.channel(found, "a" if name == "d" else "r")
        texture = None if found is None else self.owner.textures.use(found, is_color or channel == "a")
        if isinstance(default, tuple):
            values = self._color(name, default[0] if texture is None else 1.0)
            factor = values if max(values) else (1.0,) * 3
            return values if texture is None else {"texture": texture, "factor": list(factor)}
        value = self._scalar(name, default or 0.0 if texture is None else 1.0)
        if found is None or texture is None:
            return value
        return {"texture": texture, "channel": channel, "factor": value or 1.0}

    def is_given(self, name: str) -> bool:
        return name in self.mtl.numbers or (name == "d" and "tr" in self.mtl.numbers)

    def is_textured(self, name: str) -> bool:
        return MAPS.get(name) in self.mtl.maps

    def bump(self, name: str) -> dict[str, Any] | None:
        return None  # which is read by its image, as heights are

    def warn(self, name: str, detail: str) -> None:
        self.notes.add(self.mtl.places.get(name, self.mtl.place), detail)

    def scale(self, factor: Any) -> dict[str, Any]:
        return {"factor": factor}

    def miss_ambient(self) -> None:
        """Warn about a colour that only Ka has: most files repeat Kd there, or say 1."""
        numbers, maps, places = self.mtl.numbers, self.mtl.maps, self.mtl.places
        if "map_ka" in places and "map_kd" not in maps:
            self.notes.add(places["map_ka"], "a texture of ambient light (map_Ka) is not used; map_Kd is")
        elif "ka" in places and not (
            "transmission" in self.material
            or any(any(numbers.get(keyword, ())) for keyword in ("kd", "ks", "ke"))
            or any(keyword in maps for keyword in ("map_kd", "map_ks", "map_ke"))
        ):
            self.notes.add(places["ka"], "a colour of ambient light (Ka) is not used; Kd is")

    def _color(self, name: str, default: float) -> tuple[float, ...]:
        values = self.mtl.color(name, default)
        if name != "ke":
            return self._clamped(name, values)
        if min(values) < 0 or max(values) > BRIGHTEST:
            self.note("ke", "an emission (Ke) below 0 or above 1e20 is not supported; it is clamped")
        return tuple(min(max(value, 0.0), BRIGHTEST) for value in values)

    def _scalar(self, name: str, default: float) -> float:
        if name in ("illum", "ni", "ns", "anisor"):
            return self.mtl.number(name, default)
        if name == "d" and "d" not in self.mtl.numbers and "tr" in self.mtl.numbers:
            opacity = 1 - self._clamped("tr", (self.mtl.number("tr", 0.0),))[0]
            if opacity == 0 and self.mtl.number("illum", 2) not in wavefront.GLASS:
                self.note("tr", "Tr 1 without d would hide the surface; it is shown opaque, as programs differ in Tr")
                return 1.0
            return opacity
        (value,) = self._clamped(name, (self.mtl.number(name, default),))
        if name == "aniso" and value and not self.owner.has_uvs:
            self.note(name, "anisotropy needs texture coordinates, which the mesh lacks; it is left out")
            return 0.0
        return value

    def _clamped(self, name: str, values: tuple[float, ...]) -> tuple[float, ...]:
        if min(values) < 0 or max(values) > 1:
            self.note(name, f"{name} outside 0..1 is not supported; it is clamped")
        return tuple(min(max(value, 0.0), 1.0) for value in values)


class _Relief:
    """Normals and heights of one material."""

    def __init__(self, owner: Materials, material: MtlMaterial) -> None:
        self.owner, self.mtl, self.notes = owner, material, owner.notes

    def document(self) -> dict[str, Any]:
        """Normals and heights. The image under bump may be of either."""
        normals, bump, disp = (
            self.owner.map(self.mtl, "norm"),
            self.owner.map(self.mtl, "map_bump"),
            self.owner.map(self.mtl, "disp"),
        )
        bump, disp = (each if each is not None and self.owner.textures.holds(each) else None for each in (bump, disp))
        if bump is not None and self.owner.textures.is_normal_map(bump):
            if normals is None:
                self.notes.add(bump.place, "the image under bump holds normals and is used as a normal map")
                normals = bump
            bump = None
        if bump is not None and disp is not None:
            self.notes.add(disp.place, "the heights under bump are used, and not these")
        found = self._normal(normals)
        return found | self._height(bump or disp, bool(found))

    def _height(self, found: Map | None, has_normals: bool) -> dict[str, Any]:
        texture = None if found is None else self.owner.textures.use(found)
        if found is None or texture is None:
            return {}
        if "-bm" in found.options:
            scale = _number(found.options["-bm"])
            assumed = f"-bm {scale:g} is taken for the metres from black to white"
        else:
            scale = self.owner.relief
            assumed = f"without -bm, {scale:g} m from black to white are assumed: 1 % of the model's size"
        shown = "; the normal map shows them, unless a shape has displacement" if has_normals else ""
        self.notes.add(found.place, f"the image holds heights; {assumed}{shown}")
        height = {"texture": texture, "channel": self.owner.textures.channel(found, "r"), "scale": scale}
        return {"height": height | ({"shading": False} if has_normals else {})}

    def _normal(self, found: Map | None) -> dict[str, Any]:
        texture = None if found is None else self.owner.textures.use(found)
        if found is None or texture is None:
            return {}
        scale = _number(found.options.get("-bm", ("1",)))
        if scale < 0:
            self.notes.add(found.place, "a negative scale (-bm) is not supported; the normal map is left out")
            return {}
        return {"normal_map": {"texture": texture} | ({"scale": scale} if scale != 1 else {})}


def _number(words: tuple[str, ...]) -> float:
    try:
        return min(max(float(words[0]), -1e6), 1e6)
    except (ValueError, IndexError):
        return 1.0
