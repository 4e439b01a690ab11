"""The inputs of `gltf_pbr` in a file: the metallic-roughness model and the KHR_materials_* extensions."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from service.formats.read.gltf import anisotropy_texture, iridescence
from service.formats.read.gltf.json_view import JsonView
from service.formats.read.gltf.material_reader import MaterialReader
from service.formats.surface.gltf import BLEND, DEFAULTS, MASK, OPAQUE
from service.formats.surface.gltf_members import GLOSSY, ROUGH, ROWS, Row
from service.formats.surface.plain import Default, Given, PlainInputs, tree_of
from service.formats.surface.trees import Tree
from service.formats.types import LARGEST

MODES = {"OPAQUE": OPAQUE, "MASK": MASK, "BLEND": BLEND}
BASE = {ROUGH: ("baseColorFactor", "baseColorTexture"), GLOSSY: ("diffuseFactor", "diffuseTexture")}


class MaterialInputs(PlainInputs):
    """`base` is the extension that has the colour, and `made` are inputs that are converted from others."""

    def __init__(self, read: MaterialReader, base: str = ROUGH, made: Mapping[str, Given] | None = None) -> None:
        super().__init__(DEFAULTS)
        self.material["metallic"] = 0.0  # written out, as glTF's own default is 1
        self.read, self.base, self.made = read, base, made or {}

    def given(self, name: str, default: Default) -> Given | None:
        if name in self.made:
            return self.made[name]
        row, owner = self._found(name)
        if owner is None:
            return None
        if name in _SPECIAL:
            return _SPECIAL[name](self.read, owner)
        if name in ("base_color", "alpha"):
            *color, alpha = owner.color(row.factor, (1.0,) * 4)
            if name == "alpha":
                return self.read.scalar(owner, row.texture, alpha, "a", "srgb")
            return self.read.color(owner, row.texture, tuple(color))
        factor = _factor(owner, row, default)
        if isinstance(factor, tuple):
            return self.read.color(owner, row.texture, factor)
        return self.read.scalar(owner, row.texture, factor, row.channel) if row.texture else factor

    def is_given(self, name: str) -> bool:
        return self._found(name)[1] is not None

    def is_textured(self, name: str) -> bool:
        row, owner = self._found(name)
        if owner is None or row.texture not in owner:
            return False
        default = (1.0,) * 4 if name in ("base_color", "alpha") else self.defaults[name]
        found = _factor(owner, row, default)
        return max(found) > 0 if isinstance(found, tuple) else found > 0

    def bump(self, name: str) -> dict[str, Any] | None:
        row, owner = self._found(name)
        info = None if owner is None else owner.object(row.factor)
        if owner is None or info is None:
            return None
        notes = self.read.notes
        if self.read.textures.channels(info) == "L":
            notes.add(info.pointer, "a grey image is not a normal map; it is left out")
            return None
        texture, scale = self.read.texture(owner, row.factor), info.number("scale", 1, -1e6, 1e6)
        if texture is not None and scale < 0:
            notes.add(info.at("scale"), "a negative scale is not supported; the normal map is left out")
        if texture is None or scale < 0:
            return None
        return {"texture": texture} | ({"scale": scale} if scale != 1 else {})

    def masked(self, name: str, mask: str) -> Tree:
        """Of a film alone, whose image is computed."""
        owner = self._found(mask)[1]
        if self.is_trial or owner is None:
            return self.tree(name)
        return tree_of(iridescence.thickness(self.read, owner, is_masked=True), self.defaults[name])

    def warn(self, name: str, detail: str) -> None:
        row, owner = self._found(name)
        if owner is not None:
            self.read.notes.add(owner.at(row.factor or row.texture), detail)

    def scale(self, factor: Any) -> dict[str, Any]:
        return {"factor": factor}

    def _found(self, name: str) -> tuple[Row, JsonView | None]:
        """Where an input stands, and the object that has it."""
        row = Row(self.base, *BASE[self.base]) if name in ("base_color", "alpha") else ROWS.get(name)
        return (Row("", ""), None) if row is None else (row, self.read.owner(row.extension))


def _factor(owner: JsonView, row: Row, default: Default | tuple[float, ...]) -> float | tuple[float, ...]:
    if row.factor not in owner:
        return default or 0.0
    if isinstance(default, tuple):
        return owner.color(row.factor, default)
    return owner.number(row.factor, default or 0.0, row.low, row.high)


def _emissive(read: MaterialReader, owner: JsonView) -> Given:
    strength = read.owner("emissive_strength")
    scale = strength.number("emissiveStrength", 1, 0) if strength else 1.0
    return read.color(owner, "emissiveTexture", tuple(owner.radiance("emissiveFactor", (0.0, 0.0, 0.0), scale)))


def _ior(read: MaterialReader, owner: JsonView) -> float:
    """0 asks for full reflection, as an index without an end has it."""
    return owner.number("ior", 1.5, 0) or LARGEST


def _alpha_mode(read: MaterialReader, owner: JsonView) -> float:
    mode = owner.text("alphaMode", "OPAQUE")
    if mode not in MODES:
        meant = mode.upper() if mode.upper() in MODES else "OPAQUE"
        detail = f"must be OPAQUE, MASK or BLEND, not {mode[:40]!r}; {meant} is used instead"
        read.notes.add(owner.at("alphaMode"), detail)
        return MODES[meant]
    return MODES[mode]


def _strength(read: MaterialReader, owner: JsonView) -> Given:
    strength = owner.number("anisotropyStrength", 0, 0, 1)
    if strength and not read.directed:
        detail = "anisotropy needs TEXCOORD_0 or TANGENT; it is left out on a mesh that has neither"
        read.notes.add(owner.pointer, detail)
        return 0.0
    return read.scalar(owner, "anisotropyTexture", strength, "b")


def _rotation(read: MaterialReader, owner: JsonView) -> Given:
    """In radians."""
    turn, info = owner.number("anisotropyRotation", 0, -1e6, 1e6), owner.object("anisotropyTexture")
    found = anisotropy_texture.rotation(read.textures, info, read.texture(owner, "anisotropyTexture"), turn)
    if not isinstance(found, dict):
        return math.radians(found)
    read.notes.add(
        owner.at("anisotropyTexture"),
        "the directions are converted to angles; where these wrap around, a line one texel wide may be wrong",
    )
    return found | {"factor": math.radians(found["factor"])}


# Inputs that are more than a factor times a texture.
_SPECIAL: dict[str, Callable[[MaterialReader, JsonView], Given]] = {
    "emissive": _emissive,
    "ior": _ior,
    "alpha_mode": _alpha_mode,
    "anisotropy_strength": _strength,
    "anisotropy_rotation": _rotation,
    "iridescence_thickness": iridescence.thickness,
}
