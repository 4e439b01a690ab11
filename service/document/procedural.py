"""Textures that are computed: noise, and ramps of colours over a coordinate or over another texture."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from service.document.base import Model, entry, hint, picker, slider
from service.document.color import Radiometric
from service.document.numbers import ZERO, Coordinate, Fraction, Point

Channel = Literal["r", "g", "b", "a"]
MOST_STOPS = 16
LARGEST_SEED = 2**32 - 1


class NoiseTexture(Model):
    """Gradient noise, in one octave or in several (fBm): a smooth pattern without a period that anybody would see.

    With N the noise of one octave, which is 0 on average and lies in -1..1 (its standard deviation is about 0.25),
    n is the sum of gain^i N_i over the octaves i, divided by the sum of gain^i; each octave is `lacunarity` times as
    fine as the one before, turned, and has cells of its own. With `turbulence` N_i is its absolute value, so that n
    lies in 0..1. The texture's colour is a + (b - a) t, where t = 1/2 + contrast n / 2 or, with turbulence,
    t = contrast n, kept to 0..1. Its three channels are the colour's; it has no alpha.
    """

    type: Literal["noise"]
    a: Annotated[Radiometric, picker("First", "The colour or value where the noise is lowest.", soft=1)] = ZERO
    b: Annotated[Radiometric, picker("Second", "The colour or value where it is highest.", soft=1)] = (1.0, 1.0, 1.0)
    space: Annotated[
        Literal["object", "uv"],
        hint("Space", "object: solid, as in marble or wood; uv: on the surface, along its texture coordinates."),
    ] = "object"
    scale: Annotated[
        Point,
        entry(
            "Scale",
            "Cells of the first octave a metre along x, y and z, or along u and v; unequal numbers "
            "stretch the pattern.",
            unit="",
        ),
    ] = (4.0, 4.0, 4.0)
    offset: Annotated[Point, entry("Offset", "Moves the pattern, in cells.", unit="")] = ZERO
    octaves: Annotated[
        int, Field(ge=1, le=10), slider("Octaves", "How many layers of finer detail there are. Each costs time.")
    ] = 4
    lacunarity: Annotated[
        float, Field(ge=1, le=4), slider("Lacunarity", "How much finer each layer is than the one before.")
    ] = 2.0
    gain: Annotated[Fraction, slider("Gain", "How strong each finer layer is: the roughness of the detail.")] = 0.5
    turbulence: Annotated[bool, hint("Turbulence", "On: with creases, as in marble.")] = False
    contrast: Annotated[
        float, Field(ge=0, le=1000), slider("Contrast", "How far the two colours stand apart.", soft=8)
    ] = 2.0
    seed: Annotated[
        int, Field(ge=0, le=LARGEST_SEED), entry("Seed", "Another number gives another pattern.", unit="")
    ] = 0


class RampStop(Model):
    """A colour, and where the ramp has it."""

    position: Annotated[Fraction, slider("Position", "Where on the ramp it lies, from 0 to 1.")]
    color: Annotated[Radiometric, picker("Colour", "The colour or value there.", soft=1)]


class RampInput(Model):
    """Another texture, which must be no ramp itself. A byte of an image counts as byte / 255 unless its texture says
    that it is sRGB."""

    texture: Annotated[str, hint("Texture", "The name of one of the scene's textures.")]
    channel: Annotated[Channel, hint("Channel", "Which of the texture's channels is read.")] = "r"


def _form(value: Any) -> str:
    return TEXTURE_TAG if isinstance(value, dict | RampInput) else COORDINATE_TAG


COORDINATE_TAG, TEXTURE_TAG = "<coordinate>", "<texture>"


class RampTexture(Model):
    """Colours along a line, over a texture coordinate or over another texture.

    With x the input, t = offset + scale x is brought to 0..1 as `wrap` says: kept there; its fraction; or its
    fraction by turns forwards and backwards. The stops count in the order of their positions, those of equal
    positions in the order in which they are given. Before the first stop and after the last the colour stays; in
    between, `interpolation` says whether it goes on in a straight line, keeps the colour of the stop before, or eases
    in and out (3 w^2 - 2 w^3).
    """

    type: Literal["ramp"]
    input: Annotated[
        Annotated[Literal["u", "v"], Tag(COORDINATE_TAG)] | Annotated[RampInput, Tag(TEXTURE_TAG)],
        Discriminator(_form),
        hint("Input", "What runs along the ramp: a texture coordinate, or another texture."),
    ] = "u"
    stops: Annotated[
        list[RampStop], Field(min_length=2, max_length=MOST_STOPS), hint("Stops", "The colours along the ramp.")
    ]
    interpolation: Annotated[
        Literal["linear", "constant", "smooth"], hint("Interpolation", "How a colour becomes the next one.")
    ] = "linear"
    scale: Annotated[
        Coordinate,
        entry("Scale", "How often the ramp is run through: 2 runs through it twice, where it repeats.", unit=""),
    ] = 1.0
    offset: Annotated[Coordinate, entry("Offset", "Moves the colours along the ramp.", unit="")] = 0.0
    wrap: Annotated[Literal["clamp", "repeat", "mirror"], hint("Wrap", "What lies beyond the ramp's ends.")] = "clamp"

    @property
    def sorted_stops(self) -> list[RampStop]:
        return sorted(self.stops, key=lambda stop: stop.position)
