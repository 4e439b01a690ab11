"""Parameters that materials of every model may have: emission, a normal map, and nearly always opacity."""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

from service.document.base import OMITTABLE, Model, hint, picker, slider
from service.document.texture import AnyFraction, AnyRadiance, HeightTexture, NormalTexture

Emission = Annotated[
    AnyRadiance,
    picker(
        "Emission",
        "The light that leaves the front side. Above 0 the thing is a lamp.",
        "Emission",
        unit="W/(m^2 sr)",
        soft=20,
    ),
]
EmissionSides = Annotated[
    Literal["front", "both"],
    hint("Emitting sides", "Whether only the front shines, or the back as well.", "Emission"),
]
NormalMap = Annotated[
    NormalTexture | None,
    OMITTABLE,
    hint(
        "Normal map",
        "Small bumps: an image that changes how the surface catches the light, but not its outline.",
        "Geometry",
    ),
]
Height = Annotated[
    HeightTexture | None,
    OMITTABLE,
    hint(
        "Height",
        "Relief: it changes how the surface catches the light, and moves the surface of meshes with displacement.",
        "Geometry",
    ),
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
        """True if it says by itself what is under its surface."""
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
        AnyFraction, slider("Alpha", "1 is solid, 0.5 a fine mesh, 0 is not there at all.", "Geometry")
    ] = 1.0
    alpha_cutoff: Annotated[
        AnyFraction | None,
        OMITTABLE,
        slider(
            "Alpha cutoff",
            "Cuts the shape out sharply: an opacity of at least this is solid, anything below is not there.",
            "Geometry",
            absent="off",
        ),
    ] = None
    normal_map: NormalMap = None
    height: Height = None
