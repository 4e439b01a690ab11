"""What materials of every model may have: emission, a normal map, and nearly always opacity."""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

from service.scene.base import OMITTABLE, Model, hint
from service.scene.texture import AnyFraction, AnyRadiance, HeightTexture, NormalTexture

Emission = Annotated[
    AnyRadiance,
    hint(
        "Emission",
        "Radiance that leaves the front side: above 0 the shape is an area light.",
        group="Emission",
        unit="W/(m^2 sr)",
        widget="color",
        soft=20,
    ),
]
EmissionSides = Annotated[
    Literal["front", "both"],
    hint(
        "Emitting sides",
        "Whether the emission leaves the outward side only, or the inward side as well.",
        group="Emission",
    ),
]
NormalMap = Annotated[
    NormalTexture | None,
    OMITTABLE,
    hint("Normal map", "Bends the surface's normal without moving the surface.", group="Geometry"),
]
Height = Annotated[
    HeightTexture | None,
    OMITTABLE,
    hint("Height", "Relief: bends the normal, and moves the surface of meshes with displacement.", group="Geometry"),
]


class AnySurface(Model):
    """The base of all models."""

    @classmethod
    def name(cls) -> str:
        """The `type` of the model's documents."""
        (name,) = get_args(cls.model_fields["type"].annotation)
        return str(name)

    def value(self, name: str) -> Any:
        """A parameter as the renderer takes it: as the document has it, unless a model says else."""
        return getattr(self, name)

    @classmethod
    def chosen(cls, document: dict[str, Any], name: str, value: str) -> dict[str, Any]:
        """A document of the model with another value of a menu, and what follows from that."""
        return document | {name: value}

    def derived(self) -> dict[str, float]:
        """Members of the renderer's record that follow from several parameters."""
        return {}

    def is_filled(self) -> bool:
        """Whether it says by itself what is under its surface."""
        return False

    @classmethod
    def left(cls, old: dict[str, Any], made: dict[str, Any]) -> set[str]:
        """Bring to `made`, a document of another model with what both know by one name, what else there is of `old`,
        a document of this one; the names that were made use of."""
        return set()

    @classmethod
    def taken(cls, old: dict[str, Any], made: dict[str, Any]) -> set[str]:
        """The same, where `made` is a document of this model."""
        return set()


class SolidSurface(AnySurface):
    """The base of models that have no opacity."""

    emission: Emission = (0.0, 0.0, 0.0)
    emission_sides: EmissionSides = "front"
    normal_map: NormalMap = None
    height: Height = None


class Surface(AnySurface):
    """The base of models that have an opacity."""

    emission: Emission = (0.0, 0.0, 0.0)
    emission_sides: EmissionSides = "front"
    alpha: Annotated[
        AnyFraction,
        hint(
            "Alpha",
            "The chance that a ray meets the surface: 0 is not there, 0.5 a fine mesh.",
            group="Geometry",
            unit="",
            widget="slider",
        ),
    ] = 1.0
    alpha_cutoff: Annotated[
        AnyFraction | None,
        OMITTABLE,
        hint(
            "Alpha cutoff",
            "Where given, an alpha of at least this counts as 1, any other as 0.",
            group="Geometry",
            unit="",
            widget="slider",
            absent="off",
        ),
    ] = None
    normal_map: NormalMap = None
    height: Height = None
