"""One material of the document as a glTF material: the parts that all of them have."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from service.document.texture import ColorTexture, NormalTexture, ScalarTexture
from service.exports.gltf.builder import Tree
from service.exports.gltf.textures import ALPHA, Plane, Textures
from service.problems import escaped

COLORS = ("base_color", "albedo", "diffuse")  # names of a model's colour


@dataclass(frozen=True)
class Asked:
    """Properties of shapes that glTF has in the material."""

    double_sided: bool = True
    fades: bool = False  # vertices have an alpha
    thickness: float = 1.0  # m, of a body that transmits; rasterisers bend what is behind it by this much


class MaterialWriter:
    """The base colour with alpha, and what is told of all other fields."""

    def __init__(self, material: Any, name: str, textures: Textures, asked: Asked) -> None:
        """`material` is the document's of this name, or `principled` in its place."""
        self.material, self.asked, self.textures = material, asked, textures
        self.builder, self.losses = textures.builder, textures.losses
        self._pointer = f"/materials/{escaped(name)}"
        self.given = textures.scene.materials[name]
        self._given = type(self.given).model_fields.keys()

    def tell(self, field: str, detail: str) -> None:
        """Tell of a loss at a field that the document has; a converted material may have got others."""
        if self._named(field) in self._given:
            self.losses.add(self.at(field), detail)

    def at(self, field: str) -> str:
        """The pointer to a field, by the document's name for it."""
        return f"{self._pointer}/{self._named(field)}"

    def _named(self, field: str) -> str:
        others = (name for name in COLORS if name in self._given)
        return field if field in self._given or field not in COLORS else next(others, field)

    def base(self, color: Any, field: str) -> Tree:
        """pbrMetallicRoughness with the colour and alpha, and how alpha counts."""
        alpha, cutoff = self.material.alpha, self.material.alpha_cutoff
        if isinstance(cutoff, ScalarTexture):
            self.tell("alpha_cutoff", "a texture of thresholds has no place in glTF; alpha is blended")
            cutoff = None
        factor, planes = self.color(color, field)
        share, plane = self.scalar(alpha, "alpha", ALPHA)
        if share == 1 and plane is None and cutoff is None and not self.asked.fades:
            made: Tree = {}
        else:
            made = {"alphaMode": "BLEND"} if cutoff is None else {"alphaMode": "MASK", "alphaCutoff": cutoff}
            if plane is None and any(planes) and isinstance(color, ColorTexture) and self.textures.has_alpha(color):
                plane = Plane(value=1.0)  # the image's own alpha does not count
        if plane is not None and plane.reference is not None and not any(planes):
            self.tell(field, "the colour becomes a factor on a white image beside alpha's, which rounds it")
            planes = (Plane(), Plane(), Plane())
        info = self.textures.info((*planes, plane), is_srgb=True)
        rough: Tree = {}
        if (*factor, share) != (1, 1, 1, 1):
            rough["baseColorFactor"] = [*factor, share]
        if info is not None:
            rough["baseColorTexture"] = info
        return {"pbrMetallicRoughness": rough, **made}

    def color(self, value: Any, field: str, most: float = 1.0) -> tuple[tuple[float, ...], Any]:
        """The factor within 0..`most`, and the planes of red, green and blue, None without a texture."""
        if not isinstance(value, ColorTexture):
            return value, (None, None, None)
        factor = value.factor
        if max(factor) > most:
            self.tell(field, f"the texture's factor ends at {most:g} in glTF")
            factor = tuple(min(each, most) for each in factor)  # type: ignore[assignment]
        if max(factor) == 0:
            return factor, (None, None, None)
        return factor, tuple(self.textures.plane(value, k, self.at(field)) for k in range(3))

    def scalar(self, value: Any, field: str, channel: int, most: float = 1.0) -> tuple[float, Plane | None]:
        """The factor within 0..`most`, and the plane of its texture."""
        if not isinstance(value, ScalarTexture):
            return value, None
        factor = value.factor
        if factor > most:
            self.tell(field, f"the texture's factor ends at {most:g} in glTF")
            factor = most
        return factor, None if factor == 0 else self.textures.plane(value, channel, self.at(field))

    def normal(self, value: NormalTexture | None, field: str) -> Tree | None:
        if value is None:
            return None
        r, g, b = (self.textures.plane(value, k, self.at(field)) for k in range(3))
        info = self.textures.info((r, g, b, None), is_srgb=False)
        return None if info is None else info | ({"scale": value.scale} if value.scale != 1 else {})

    def tell_others(self, written: set[str]) -> None:
        """Tell of all fields that are given, differ from their defaults, and are not `written`."""
        for name in sorted(self.material.model_fields_set - written - {"type", "alpha", "alpha_cutoff"}):
            default = type(self.material).model_fields[name].default
            if getattr(self.material, name) not in (default, None):
                self.tell(name, "this has no place in glTF and is left out")
