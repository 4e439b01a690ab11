"""Pictures on surfaces: textures by name, and the references to them in materials."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self, get_args

from pydantic import Discriminator, Field, PlainValidator, Tag, WithJsonSchema, model_validator

from service.document.base import OMITTABLE, Model, hint, refusal
from service.document.color import Factors, Radiometric, Reflectance
from service.document.numbers import (
    LARGEST,
    Coordinate,
    Degrees,
    Factor,
    Fraction,
    PositiveLength,
    RefractiveIndex,
    Thickness,
    check_number,
    described,
    vector_schema,
)
from service.document.photometry import FORMS, Radiance
from service.document.procedural import Channel, NoiseTexture, RampTexture

Vec2 = tuple[float, float]


def _pair(value: Any) -> Vec2:
    if not isinstance(value, list | tuple):
        raise refusal(f"must be two numbers like [1, 1], not {described(value)}")
    if len(value) != 2:
        raise refusal(f"must be two numbers like [1, 1], not {len(value)}")
    return check_number(value[0], -LARGEST, LARGEST, "u"), check_number(value[1], -LARGEST, LARGEST, "v")


Pair = Annotated[Vec2, PlainValidator(_pair), WithJsonSchema(vector_schema(size=2))]

WrapMode = Literal["repeat", "clamp", "mirror"]
WRAPS: tuple[WrapMode, ...] = get_args(WrapMode)
_MODES = {"type": "string", "enum": list(WRAPS)}


def _wrap(value: Any) -> WrapMode | tuple[WrapMode, WrapMode]:
    if not isinstance(value, list | tuple):
        return _mode(value)
    if len(value) != 2:
        raise refusal(f"must be one word, or two for u and v, not {len(value)}")
    return _mode(value[0], "/0"), _mode(value[1], "/1")


def _mode(value: Any, at: str = "") -> WrapMode:
    for mode in WRAPS:
        if value == mode:
            return mode
    raise refusal(f"must be 'repeat', 'clamp' or 'mirror', not {described(value)}", at)


Wrap = Annotated[
    WrapMode | tuple[WrapMode, WrapMode],
    PlainValidator(_wrap),
    WithJsonSchema({"anyOf": [_MODES, {"type": "array", "items": _MODES, "minItems": 2, "maxItems": 2}]}),
]

Mapping = Annotated[
    Literal["uv", "box", "sphere"],
    hint(
        "Mapping",
        "By the shape's texture coordinates, or, without those: box, once a metre; sphere, once around the middle.",
    ),
]


def content_of(asset: str, layer: str | None) -> str:
    """A key of a layer of an image."""
    return asset if layer is None else f"{asset} {layer}"


Layer = Annotated[
    Annotated[str, Field(min_length=1, max_length=300)] | None,
    OMITTABLE,
    hint("Layer", "Of an EXR that has several, by its name; without it the picture itself.", widget="text"),
]


class ImageTexture(Model):
    """An image file; row 0 is v = 1, texel centres lie at (i + 0.5) / n."""

    asset: Annotated[str, Field(min_length=1), hint("Image", "PNG, JPEG, WebP, EXR or Radiance HDR.")]
    color_space: Annotated[
        Literal["srgb", "linear"] | None,
        OMITTABLE,
        hint("Colour space", "Without it 8-bit images in colours are sRGB, all others linear; alpha always is."),
    ] = None
    layer: Layer = None
    wrap: Annotated[Wrap, hint("Wrap", "What lies outside of the image: one word, or one for u and one for v.")] = (
        "repeat"
    )
    mapping: Mapping = "uv"
    scale: Annotated[
        Pair, hint("Scale", "Factors on u and v, applied first: 2 shows the image twice.", unit="", widget="number")
    ] = (1.0, 1.0)
    rotation: Annotated[
        Degrees,
        hint(
            "Rotation",
            "Turns u and v counter-clockwise about their origin, after the scale.",
            unit="degrees",
            widget="angle",
            soft=(-180, 180),
        ),
    ] = 0.0
    offset: Annotated[Pair, hint("Offset", "Added to u and v last.", unit="", widget="number")] = (0.0, 0.0)
    uv: Annotated[
        int, Field(ge=0, le=1),
        hint("UV set", "Of a mesh's two sets of coordinates.", unit="", widget="number", used=("mapping", ["uv"])),
    ] = 0  # fmt: skip

    @property
    def wraps(self) -> tuple[WrapMode, WrapMode]:
        """The modes along u and along v."""
        return (self.wrap, self.wrap) if isinstance(self.wrap, str) else self.wrap

    @property
    def content(self) -> str:
        """A key that is equal where the same image is shown."""
        return content_of(self.asset, self.layer)

    @model_validator(mode="after")
    def _reads_what_it_names(self) -> Self:
        if self.mapping != "uv" and self.uv != 0:
            raise refusal(f"belongs to mapping 'uv'; mapping {self.mapping!r} reads no coordinates", at="/uv")
        return self


class CheckerTexture(Model):
    """Two colours by turns: the first where floor(u scale_u) + floor(v scale_v) is even."""

    type: Literal["checker"]
    a: Annotated[Radiometric, hint("First", "Of the square at u = v = 0.", unit="", widget="color", soft=1)]
    b: Annotated[Radiometric, hint("Second", "Of its neighbours.", unit="", widget="color", soft=1)]
    scale: Annotated[Pair, hint("Scale", "How many squares along u and v.", unit="", widget="number")] = (8.0, 8.0)
    mapping: Mapping = "uv"


def _kind(value: Any) -> Any:
    return value.get("type", IMAGE_TAG) if isinstance(value, dict) else getattr(value, "type", IMAGE_TAG)


IMAGE_TAG = "<image>"

Texture = Annotated[
    Annotated[ImageTexture, Tag(IMAGE_TAG)]
    | Annotated[CheckerTexture, Tag("checker")]
    | Annotated[NoiseTexture, Tag("noise")]
    | Annotated[RampTexture, Tag("ramp")],
    Discriminator(_kind),
]


class _Reference(Model):
    texture: Annotated[str, hint("Texture", "The name of one of the scene's textures.")]


class ScalarTexture(_Reference):
    """One channel of a texture in place of a number."""

    channel: Annotated[Channel, hint("Channel", "Which of the texture's channels is read.")] = "r"
    factor: Annotated[
        Factor, hint("Factor", "Multiplies the texture; the product keeps to the parameter's range.",
                     unit="", widget="slider", soft=1)
    ] = 1.0  # fmt: skip


class ColorTexture(_Reference):
    """A texture in place of a colour."""

    channel: Annotated[Channel | None, OMITTABLE, hint("Channel", "Read as a grey; without it, the colour.")] = None
    factor: Annotated[
        Factors, hint("Factor", "Multiplies the decoded texture; the product keeps to the parameter's range.",
                      unit="", widget="color", soft=1)
    ] = (1.0, 1.0, 1.0)  # fmt: skip


class NormalTexture(_Reference):
    """A normal map: red along growing u, green along growing v, blue outwards."""

    scale: Annotated[
        Factor, hint("Strength", "Multiplies red and green: 0 is flat, 1 as the map has it.",
                     unit="", widget="slider", soft=2)
    ] = 1.0  # fmt: skip


class HeightTexture(_Reference):
    """Heights above the surface, in metres along its normal: the scale times the texture minus the midlevel."""

    channel: Annotated[Channel, hint("Channel", "Which of the texture's channels is read.")] = "r"
    scale: Annotated[
        Coordinate, hint("Relief", "How far white lies above black; below 0 white is deep.",
                         unit="m", widget="slider", soft=(0, 0.1), log=1e-5)
    ] = 0.02  # fmt: skip
    midlevel: Annotated[
        Coordinate, hint("Midlevel", "The value of the texture that lies where the surface is.",
                         unit="", widget="slider", soft=(0, 1))
    ] = 0.5  # fmt: skip
    shading: Annotated[
        bool, hint("In the shading", "Off: only shapes with displacement show it, as where a normal map shows the "
                                     "same relief.")
    ] = True  # fmt: skip


def is_projected(texture: object) -> bool:
    """True where a texture lies in the shape's own space: it reads no texture coordinates."""
    return isinstance(texture, ImageTexture | CheckerTexture) and texture.mapping != "uv"


VALUE_TAG, REFERENCE_TAG = "<value>", "<reference>"


def form_of(value: Any) -> str:
    is_value = isinstance(value, dict) and not FORMS.isdisjoint(value)
    return REFERENCE_TAG if isinstance(value, dict | _Reference) and not is_value else VALUE_TAG


AnyFraction = Annotated[
    Annotated[Fraction, Tag(VALUE_TAG)] | Annotated[ScalarTexture, Tag(REFERENCE_TAG)], Discriminator(form_of)
]
AnyFactor = Annotated[
    Annotated[Factor, Tag(VALUE_TAG)] | Annotated[ScalarTexture, Tag(REFERENCE_TAG)], Discriminator(form_of)
]
AnyDegrees = Annotated[
    Annotated[Degrees, Tag(VALUE_TAG)] | Annotated[ScalarTexture, Tag(REFERENCE_TAG)], Discriminator(form_of)
]
AnyLength = Annotated[
    Annotated[PositiveLength, Tag(VALUE_TAG)] | Annotated[ScalarTexture, Tag(REFERENCE_TAG)], Discriminator(form_of)
]
AnyIndex = Annotated[
    Annotated[RefractiveIndex, Tag(VALUE_TAG)] | Annotated[ScalarTexture, Tag(REFERENCE_TAG)], Discriminator(form_of)
]
AnyThickness = Annotated[
    Annotated[Thickness, Tag(VALUE_TAG)] | Annotated[ScalarTexture, Tag(REFERENCE_TAG)], Discriminator(form_of)
]
AnyReflectance = Annotated[
    Annotated[Reflectance, Tag(VALUE_TAG)] | Annotated[ColorTexture, Tag(REFERENCE_TAG)], Discriminator(form_of)
]
AnyRadiance = Annotated[
    Annotated[Radiance, Tag(VALUE_TAG)] | Annotated[ColorTexture, Tag(REFERENCE_TAG)], Discriminator(form_of)
]
AnyRadiometric = Annotated[
    Annotated[Radiometric, Tag(VALUE_TAG)] | Annotated[ColorTexture, Tag(REFERENCE_TAG)], Discriminator(form_of)
]

Reference = ScalarTexture | ColorTexture | NormalTexture | HeightTexture


def references(material: Any) -> dict[str, Reference]:
    """A material's references to textures, by the name of the field."""
    found = ((name, material.value(name)) for name in type(material).model_fields)
    return {name: value for name, value in found if isinstance(value, _Reference)}  # type: ignore[misc]
