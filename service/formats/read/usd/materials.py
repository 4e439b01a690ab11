"""Materials that meshes are bound to -> the document's."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from pxr import Usd, UsdShade

from service.formats.read.scenes.names import unique
from service.formats.read.scenes.warnings import Warnings
from service.formats.read.usd.material_reader import Edge, Reader
from service.formats.read.usd.networks import Node, others_of, surface_of
from service.formats.read.usd.textures import Textures
from service.formats.surface import MODELS
from service.formats.surface.choice import lost, rich_is_better
from service.formats.surface.inputs import PART

PREVIEW = "UsdPreviewSurface"
SHOWN = ("standard_surface", "open_pbr_surface", "gltf_pbr", PREVIEW)
RICH = {f"ND_{name}_surfaceshader": MODELS[name] for name in SHOWN}
GREY = 0.8  # albedo of a mesh without a material and without a colour


@dataclass(frozen=True)
class Bound:
    """A material of the document, and what it takes from the meshes that have it."""

    name: str
    charts: tuple[str, ...] = ()  # primvars with texture coordinates, at most two
    is_colored: bool = False
    edges: tuple[Edge, ...] = ()


@dataclass
class Materials:
    textures: Textures
    time: Usd.TimeCode
    unit: float  # metres per unit of the stage
    notes: Warnings
    documents: dict[str, dict[str, Any]] = field(default_factory=dict)
    _bound: dict[str, Bound] = field(default_factory=dict)
    _colors: dict[tuple[float, ...], Bound] = field(default_factory=dict)

    def of(self, prim: Usd.Prim) -> UsdShade.Material | None:
        """The material that is bound to a mesh, or to a part of one: for final pictures, for all, or for previews."""
        for purpose in (UsdShade.Tokens.full, UsdShade.Tokens.preview):
            material, relation = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(purpose)
            if material:
                return material
            if relation:
                lost = next((str(path) for path in relation.GetTargets()), "")
                detail = f"the material {lost[:100]} that it names is not in this file; it is shown without one"
                self.notes.add(str(relation.GetPrim().GetPath()), detail)
                return None
        return None

    def key(self, material: UsdShade.Material | None) -> str:
        """Equal for the same material in all instances of a prim."""
        if material is None:
            return ""
        prim = material.GetPrim()
        return str((prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim).GetPath())

    def use(self, material: UsdShade.Material) -> Bound | None:
        """The material in the document; None, with a warning, where it has no surface that is read."""
        key = self.key(material)
        if key not in self._bound:
            read = self._read(material)
            if read is None:
                return None
            name = unique(material.GetPrim().GetName(), self.documents)
            self.documents[name] = read.document
            self._bound[key] = Bound(name, tuple(read.uses.charts), read.uses.is_colored, tuple(read.uses.edges))
        return self._bound[key]

    def plain(self, color: list[float] | None, is_colored: bool, opacity: float = 1.0) -> Bound:
        """A material for what has none: in the one colour of a mesh, in those of its vertices, or grey."""
        shown = (1.0,) * 3 if is_colored else tuple(color or (GREY,) * 3)
        key = (*shown, float(is_colored), opacity)
        if key not in self._colors:
            base = "vertex colours" if is_colored else "colour" if color else "default"
            name = unique(base, self.documents)
            fades = {"alpha": opacity} if opacity < 1 else {}
            self.documents[name] = {"type": "principled", "base_color": list(shown), "roughness": 0.5, **fades}
            self._colors[key] = Bound(name, (), is_colored)
        return self._colors[key]

    @property
    def shown(self) -> dict[str, dict[str, Any]]:
        """The textures that a material shows: those of a surface that another one replaces are left out."""
        values = [value for one in self.documents.values() for value in one.values() if isinstance(value, dict)]
        names = {value.get("texture") for value in values}
        return {name: found for name, found in self.textures.documents.items() if name in names}

    def _read(self, material: UsdShade.Material) -> Reader | None:
        """MaterialX first, which says more; the preview's surface where it loses less."""
        for name, shader in others_of(material, self.time):
            if shader.kind != PREVIEW:  # whose displacement is an input of its surface
                self.notes.add(shader.pointer, f"the {name} of a material is not supported and is left out")
        preview, rich = surface_of(material, "", self.time), surface_of(material, "mtlx", self.time)
        if rich is None and preview is not None and preview.kind in RICH:
            preview, rich = None, preview
        fallback = preview if preview is not None and preview.kind == PREVIEW else None
        if rich is not None and rich.kind in RICH:
            notes, others = Warnings(), Warnings()
            read = Reader(rich, RICH[rich.kind], self.textures, self.unit, notes)
            plain = None
            if fallback is not None and _lost(read) > 0:
                plain = Reader(fallback, MODELS[PREVIEW], self.textures, self.unit, others)
            if plain is None or rich_is_better(_lost(read), _lost(plain), _said(read) - _said(plain)):
                self.notes.take(notes)
                return read
            detail = "the MaterialX surface has what is not supported; its UsdPreviewSurface is shown instead"
            self.notes.add(rich.pointer, detail)
            self.notes.take(others)
            return plain
        if fallback is not None:
            return Reader(fallback, MODELS[PREVIEW], self.textures, self.unit, self.notes)
        other: Node | None = rich or preview
        what = f"its surface is {other.kind[:60] or 'code'}" if other else "it has no surface of these"
        detail = (
            f"the material is not supported ({what}); UsdPreviewSurface, standard_surface, OpenPBR and gltf_pbr are"
        )
        self.notes.add(str(material.GetPath()), detail)
        return None


def _lost(read: Reader) -> float:
    """What the losses of a surface weigh, with those of what its inputs are connected to."""
    return lost(read) + PART * read.uses.unread


def _said(read: Reader) -> int:
    """How many inputs the file says anything about."""
    return sum(read.surface.has(name) for name in read.defaults)
