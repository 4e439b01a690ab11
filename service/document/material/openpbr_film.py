"""The thin film of `openpbr`, and indices of refraction as that has them."""

from __future__ import annotations

from typing import Annotated

from pydantic import Discriminator, Field, Tag

from service.document.base import slider
from service.document.texture import REFERENCE_TAG, VALUE_TAG, AnyFactor, AnyFraction, ScalarTexture, form_of

LEAST_INDEX, LARGEST_INDEX = 1e-3, 1e3
NANOMETRES = 1e3  # of a micrometre

Index = Annotated[float, Field(ge=LEAST_INDEX, le=LARGEST_INDEX)]
AnyPositiveIndex = Annotated[
    Annotated[Index, Tag(VALUE_TAG)] | Annotated[ScalarTexture, Tag(REFERENCE_TAG)], Discriminator(form_of)
]
FilmWeight = Annotated[
    AnyFraction,
    slider("Thin film", "How much of the surface has a thin film, with the colours of a soap bubble.", "Film"),
]
FilmThickness = Annotated[
    AnyFactor, slider("Film thickness", "Soap 0.2 to 0.8, oxides of metals 0.03 to 0.2.", "Film", unit="um", soft=1)
]
FilmIndex = Annotated[
    AnyPositiveIndex,
    slider(
        "Film index",
        "How strongly the film bends light: water 1.33, oil 1.47, oxides of metals 1.8 to 2.6. A texture gives 1 "
        "to 4.",
        "Film",
        known_as="film_ior",
        soft=(1, 3),
    ),
]


def in_nanometres(thickness: float | ScalarTexture) -> float | ScalarTexture:
    """A thickness that is given in micrometres."""
    if isinstance(thickness, ScalarTexture):
        return thickness.model_copy(update={"factor": NANOMETRES * thickness.factor})
    return NANOMETRES * thickness
