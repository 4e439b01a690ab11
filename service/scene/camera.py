"""The camera: a pinhole, or a thin lens where it has an aperture."""

from __future__ import annotations

import math
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from service.scene.base import OMITTABLE, Model, hint, refusal
from service.scene.numbers import Direction, Length, Point, PositiveLength

# Below this sine of the angle between up and the view the rounding of float64 coordinates of 1e9 decides what is up.
LEAST_SINE = 1e-7


class Camera(Model):
    """Looks from `position` to `target`."""

    position: Annotated[Point, hint("Position", "Where the camera stands.", unit="m", widget="number")]
    target: Annotated[Point, hint("Target", "The point in the middle of the picture.", unit="m", widget="number")]
    up: Annotated[
        Direction,
        hint("Up", "The direction that is upward in the picture; any but the view's own.", unit="", widget="number"),
    ] = (0.0, 1.0, 0.0)
    vfov: Annotated[
        float,
        Field(gt=0, lt=180),
        hint(
            "Field of view",
            "Vertical angle; 40 is a short telephoto, 75 a wide angle.",
            unit="degrees",
            widget="slider",
            soft=(5, 120),
        ),
    ] = 40.0
    aperture_radius: Annotated[
        Length,
        hint(
            "Aperture radius",
            "0 is a pinhole, sharp everywhere; larger blurs what is out of focus.",
            unit="m",
            widget="slider",
            soft=0.2,
        ),
    ] = 0.0
    focus_distance: Annotated[
        PositiveLength | None,
        OMITTABLE,
        hint(
            "Focus distance",
            "Along the axis to the plane that is sharp; without it, the target's.",
            unit="m",
            widget="slider",
            soft=20,
        ),
    ] = None

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
