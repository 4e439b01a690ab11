"""The environment around the scene; without one it is black."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from service.document.base import OMITTABLE, Model, dial, hint, picker, refusal, slider
from service.document.medium import Medium
from service.document.numbers import BRIGHTEST, Degrees, Factor, Fraction
from service.document.photometry import Radiance
from service.document.texture import Layer


class _Surroundings(Model):
    rotation: Annotated[
        Degrees,
        dial(
            "Rotation",
            "Turns the surroundings about the vertical, counter-clockwise seen from above.",
            soft=(-180, 180),
        ),
    ] = 0.0
    scale: Annotated[
        Factor, slider("Brightness", "How bright the surroundings are. Twice as much is one stop.", soft=4)
    ] = 1.0
    background: Annotated[
        bool,
        hint(
            "Show as background", "Off: it lights the scene, but the picture is transparent where it would be seen."
        ),
    ] = True
    medium: Annotated[
        Medium | None, OMITTABLE, hint("Medium", "What fills all space outside of bodies: fog, or the sea.")
    ] = None

    @model_validator(mode="after")
    def _shines_finitely(self) -> Self:
        if self.medium is not None:
            extinction = self.medium.extinction()
            for i, shines in enumerate(self.medium.emission):
                if shines > 0 and extinction[i] <= 0:
                    channel = ("red", "green", "blue")[i]
                    raise refusal(
                        f"must be 0 in a channel without absorption and scattering, as endless space would shine "
                        f"endlessly ({channel})", at="/medium/emission",
                    )  # fmt: skip
        return self


class ConstantEnvironment(_Surroundings):
    """The same radiance from every direction."""

    type: Literal["constant"]
    radiance: Annotated[
        Radiance,
        picker(
            "Radiance", "How bright it is in every direction, as under an overcast sky.", unit="W/(m^2 sr)", soft=4
        ),
    ]

    @model_validator(mode="after")
    def _stays_finite(self) -> Self:
        if max(self.radiance) * self.scale > BRIGHTEST:
            raise refusal(f"radiance times scale must be at most {BRIGHTEST:g}", at="/scale")
        return self


class _Picture(_Surroundings):
    blur: Annotated[
        float,
        Field(ge=0, le=90),
        slider(
            "Blur",
            "Blurs the surroundings: less noise and softer shadows, but less true to the image.",
            unit="degrees",
            soft=30,
        ),
    ] = 0.0


class ImageEnvironment(_Picture):
    """A latitude-longitude image; -Z is in its middle."""

    type: Literal["image"]
    asset: Annotated[str, Field(min_length=1), hint("Image", "A panorama of all directions, as an EXR or HDR file.")]
    layer: Layer = None


class CubeFaces(Model):
    """Six square images of one size, in OpenGL's layout, each named by the axis in its middle."""

    px: Annotated[str, Field(min_length=1), hint("+X", "Image of what lies towards +X; right is -Z, up is +Y.")]
    nx: Annotated[str, Field(min_length=1), hint("-X", "Image of what lies towards -X; right is +Z, up is +Y.")]
    py: Annotated[str, Field(min_length=1), hint("+Y", "Image of what lies above; right is +X, up is -Z.")]
    ny: Annotated[str, Field(min_length=1), hint("-Y", "Image of what lies below; right is +X, up is +Z.")]
    pz: Annotated[str, Field(min_length=1), hint("+Z", "Image of what lies towards +Z; right is +X, up is +Y.")]
    nz: Annotated[str, Field(min_length=1), hint("-Z", "Image of what lies towards -Z; right is -X, up is +Y.")]


class CubemapEnvironment(_Picture):
    """Six HDR images, the faces of a cube."""

    type: Literal["cubemap"]
    assets: Annotated[CubeFaces, hint("Faces", "Six square HDR images of one size.")]


class SkyEnvironment(_Surroundings):
    """A clear sky by day: Hosek and Wilkie's model of dome and sun, above Lambertian ground."""

    type: Literal["sky"]
    sun_elevation: Annotated[
        float, Field(ge=0, le=90), dial("Sun elevation", "Height of the sun: 0 is at the horizon, 90 overhead.")
    ]
    sun_azimuth: Annotated[Degrees, dial("Sun azimuth", "Where the sun stands: 0 is -Z, 90 is +X.", soft=(-180, 180))]
    turbidity: Annotated[
        float,
        Field(ge=1, le=10),
        slider("Turbidity", "How hazy the air is: 1 is pure air, 3 a clear day, 6 hazy, 10 murky."),
    ] = 3.0
    ground_albedo: Annotated[
        Fraction, slider("Ground albedo", "How bright the ground is: 0.3 is soil and grass.")
    ] = 0.3
    sun: Annotated[bool, hint("Sun", "Off: the sky alone, as if the sun were hidden.")] = True


Environment = Annotated[
    ConstantEnvironment | ImageEnvironment | CubemapEnvironment | SkyEnvironment, Field(discriminator="type")
]
