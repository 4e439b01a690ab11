"""The cameras: in perspective, a pinhole or a thin lens; parallel rays; all directions."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator

from service.document.base import OMITTABLE, Model, entry, refusal, slider
from service.document.numbers import Direction, Length, Point, PositiveLength

# Below this sine of the angle between up and the view the rounding of float64 coordinates of 1e9 decides what is up.
LEAST_SINE = 1e-7


class AnyCamera(Model):
    """Looks from `position` to `target`."""

    position: Annotated[Point, entry("Position", "Where the camera stands.")]
    target: Annotated[Point, entry("Target", "The point in the middle of the picture.")]
    up: Annotated[Direction, entry("Up", "The direction that is upward in the picture.", unit="")] = (0.0, 1.0, 0.0)

    @model_validator(mode="after")
    def _spans_a_view(self) -> Self:
        view = np.subtract(self.target, self.position)
        distance = math.hypot(*view)
        if np.float32(distance) == 0.0:
            raise refusal("position and target must differ: the camera looks from one to the other")
        cross = np.cross(view / distance, np.divide(self.up, math.hypot(*self.up)))
        if math.hypot(*cross) < LEAST_SINE:
            raise refusal("up must not be parallel to the view from position to target")
        return self


class PerspectiveCamera(AnyCamera):
    """Looks through a lens: what is farther away is smaller."""

    type: Literal["perspective"] = "perspective"
    vfov: Annotated[
        float,
        Field(gt=0, lt=180),
        slider(
            "Field of view",
            "How much the picture takes in from top to bottom: 40 is a short telephoto, 75 a wide angle.",
            unit="degrees",
            soft=(5, 120),
        ),
    ] = 40.0
    aperture_radius: Annotated[
        Length,
        slider("Aperture radius", "0 is sharp everywhere. Larger blurs what is out of focus.", unit="m", soft=0.2),
    ] = 0.0
    focus_distance: Annotated[
        PositiveLength | None,
        OMITTABLE,
        slider("Focus distance", "How far away things are sharp. Without it, at the target.", unit="m", soft=20),
    ] = None


class OrthographicCamera(AnyCamera):
    """Parallel rays from the plane through `position`: nothing gets smaller with its distance, as in plans."""

    type: Literal["orthographic"]
    height: Annotated[
        PositiveLength, slider("Height", "What the picture shows from bottom to top.", unit="m", soft=10)
    ]


class PanoramaCamera(AnyCamera):
    """All directions around `position`, in latitude and longitude as an environment's image has them, and `target` in
    the middle of the picture."""

    type: Literal["panorama"]


PERSPECTIVE = "perspective"


def _kind(value: Any) -> Any:
    return value.get("type", PERSPECTIVE) if isinstance(value, dict) else getattr(value, "type", PERSPECTIVE)


Camera = Annotated[
    Annotated[PerspectiveCamera, Tag(PERSPECTIVE)]
    | Annotated[OrthographicCamera, Tag("orthographic")]
    | Annotated[PanoramaCamera, Tag("panorama")],
    Discriminator(_kind),
]
