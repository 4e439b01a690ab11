"""The material models: one row each, from which the shaders' dispatchers, flags and lists of models follow.

A model is a row here, its functions in `shaders/bsdf/models/NAME.glsl`, and a class in `service/document/material`;
`gpu/kernels/models_glsl.py` says which functions the shaders call. All other code asks what a model can do, and never
for its name.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from gpu.layout.measured_records import Measured
from gpu.layout.microfacet_records import Microfacet
from gpu.layout.record import Record


class Lobe(IntEnum):
    """Numbers of shaders/bsdf/lobe.glsl. `MULTISCATTER` is light that leaves the microfacets after several of them,
    on either side; `TRANSMISSION` is refracted light."""

    DIFFUSE = 0
    SPECULAR = 1
    MULTISCATTER = 2
    SHEEN = 3
    CLEARCOAT = 4
    TRANSMISSION = 5


@dataclass(frozen=True)
class Model:
    """A material model and its abilities.

    `name` is the document's `type`; `number` is that of `layout.Material.model`. `lobes` are those that it adds up.
    """

    name: str
    number: int
    lobes: tuple[Lobe, ...]
    transmits: bool = False  # light passes where `transmission` is above 0 and `metallic` below 1
    may_be_delta: bool = False  # it only mirrors or refracts where `roughness` is below LEAST_ROUGHNESS
    depends_on_wo: bool = False  # its surface is completed by the direction that it is seen from
    needs_tables: bool = False  # it looks up what its lobes lose, in the tables of gpu/tables/energy.py
    has_terms: bool = False  # it has a distribution, a geometry and a Fresnel term
    has_coat_normals: bool = False  # its coat may have a normal of its own
    covers_emission: tuple[str, ...] = ()  # members of `layout.Material`: the layers under which its emission lies
    # The member of `layout.Material` with the colour of what is under the surface, where light walks if `subsurface`
    # and `subsurface_radius` are above 0; empty: light never does.
    walk_color: str = ""
    has_members: bool = False  # Surface has members for it alone, in shaders/bsdf/models/NAME_members.glsl
    optional: tuple[str, ...] = ()  # members of `layout.Material` that raise a flag where they are above 0
    # What it has besides `layout.Material`, and the member of `SceneArrays` that begins with one for each material.
    record: type[Record] | None = None
    records: str = ""
    words: tuple[tuple[Lobe, str], ...] = ()  # what it calls lobes that have another name elsewhere
    in_general: bool = True  # the kernel for many scenes has it; a rare one would cost all other scenes time

    @property
    def flag(self) -> str:
        """The flag of kernels that know the model."""
        return f"HAS_{self.name.upper()}"

    @property
    def walks(self) -> bool:
        """True if light may walk under its surface."""
        return bool(self.walk_color)

    @property
    def lobe_names(self) -> tuple[str, ...]:
        """The model's names for its lobes."""
        words = dict(self.words)
        return tuple(words.get(lobe, lobe.name.lower()) for lobe in self.lobes)

    @property
    def lobes_flag(self) -> str:
        """The flag of kernels that have its lobes: scenes in which all of its materials are perfectly specular can do
        without."""
        return self.flag + "_LOBES" if self.may_be_delta else self.flag


_PLAIN = (Lobe.DIFFUSE, Lobe.SPECULAR)
_LAYERS = ("subsurface", "sheen", "anisotropic", "clearcoat")

# The first has no flag: it is in every kernel. Kernels ask for the others in this order.
MODELS = (
    Model("diffuse", 0, (Lobe.DIFFUSE,)),
    Model(
        "disney",
        1,
        (Lobe.DIFFUSE, Lobe.SPECULAR, Lobe.SHEEN, Lobe.CLEARCOAT),
        has_terms=True,
        optional=_LAYERS,
    ),
    Model("metal_rough", 3, _PLAIN, has_terms=True, in_general=False),
    Model("blinn_phong", 4, _PLAIN, optional=("ambient",), in_general=False),
    Model("phong", 6, _PLAIN, optional=("ambient",), in_general=False),
    Model(
        "microfacet",
        5,
        _PLAIN,
        has_terms=True,
        has_members=True,
        record=Microfacet,
        records="microfacets",
        in_general=False,
    ),
    Model(
        "measured",
        9,
        (),
        has_members=True,
        optional=("anisotropic",),
        record=Measured,
        records="measured",
        in_general=False,
    ),
    Model(
        "principled",
        2,
        tuple(Lobe),
        transmits=True,
        may_be_delta=True,
        depends_on_wo=True,
        needs_tables=True,
        has_terms=True,
        has_coat_normals=True,
        covers_emission=("clearcoat",),
        has_members=True,
        walk_color="base_color",
        optional=(*_LAYERS, "conductor_eta", "film_thickness"),
    ),
    Model(
        "openpbr",
        8,
        tuple(Lobe),
        transmits=True,
        may_be_delta=True,
        depends_on_wo=True,
        needs_tables=True,
        has_terms=True,
        has_coat_normals=True,
        covers_emission=("clearcoat", "sheen"),
        has_members=True,
        walk_color="subsurface_color",
        optional=(
            "subsurface",
            "sheen",
            "anisotropic",
            "coat_anisotropy",
            "clearcoat",
            "diffuse_roughness",
            "film_thickness",
        ),
        words=((Lobe.SHEEN, "fuzz"), (Lobe.CLEARCOAT, "coat")),
        in_general=False,
    ),
)
FLAGGED = MODELS[1:]
NUMBERS = {model.name: model.number for model in MODELS}
BY_NUMBER = {model.number: model for model in MODELS}


def of(materials: np.ndarray, models: Iterable[Model]) -> np.ndarray:
    """True if each `layout.Material` record is of one of these models."""
    out: np.ndarray = np.isin(materials["model"], [model.number for model in models])
    return out


TRANSMITTING = tuple(model for model in MODELS if model.transmits)
WALKING = tuple(model for model in MODELS if model.walks)
DELTA = tuple(model for model in MODELS if model.may_be_delta)
COVERING = tuple(model for model in MODELS if model.covers_emission)
COATED = tuple(model for model in MODELS if model.has_coat_normals)
TABULATED = tuple(model for model in MODELS if model.needs_tables)


def with_optional(member: str) -> tuple[Model, ...]:
    """The models with an optional member of `layout.Material`."""
    return tuple(model for model in MODELS if member in model.optional)
