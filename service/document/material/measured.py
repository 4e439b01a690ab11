"""`measured`: the reflection of a real surface, as a file has it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from service.document.base import hint
from service.document.material.surface import Surface


class MeasuredMaterial(Surface):
    """Reflects as a real surface was measured: an uploaded MERL or RGL file has the values, per steradian.

    Where the file has more light reflected than arrives, it is scaled down to all of it.
    """

    model_config = ConfigDict(json_schema_extra={"x-name": "Measured"})
    type: Literal["measured"]
    asset: Annotated[
        str,
        Field(min_length=1),
        hint("Measurement", "A MERL .binary or an RGL .bsdf file.", "Base", asset=("measured", (".binary", ".bsdf"))),
    ]
