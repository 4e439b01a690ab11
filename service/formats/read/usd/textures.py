"""Images on surfaces -> the document's textures, with what a shader does to their values."""

from __future__ import annotations

import posixpath
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from service.colorimetry import decode_srgb, encode_srgb
from service.formats.errors import LAYER, ParseError
from service.formats.formats import sniff
from service.formats.images import encode
from service.formats.read.image import parse_image
from service.formats.read.other_images import readable
from service.formats.read.png_chunks import opened
from service.formats.read.scenes.names import unique
from service.formats.read.scenes.part_files import PartFiles
from service.formats.read.scenes.warnings import Warnings
from service.formats.read.scenes.wrapping import wrap_of
from service.formats.read.usd.package import INSIDE, OUTSIDE, Package
from service.formats.types import AssetLimits

PILLOW = {"png": "PNG", "jpeg": "JPEG", "webp": "WEBP"}
PNG_DEPTH = 24  # where a PNG says how many bits a channel has
CHANNELS = "rgba"
CLOSE = 1e-4
Role = Literal["color", "scalar", "normal"]
AS_IT_IS = ((1.0,) * 4, (0.0,) * 4)


@dataclass(frozen=True)
class Picture:
    """An image as a node of a network reads it: a texel times `scale` plus `bias`, channel by channel."""

    path: str
    pointer: str
    output: str  # r, g, b, a or rgb
    space: Literal["auto", "srgb", "linear"] = "auto"
    wrap: tuple[str, str] = ("repeat", "repeat")  # along u and v
    scale: tuple[float, ...] = AS_IT_IS[0]
    bias: tuple[float, ...] = AS_IT_IS[1]
    chart: str = "st"  # the name of the primvar with its texture coordinates
    placing: tuple[tuple[str, Any], ...] = ()  # members of a texture of the document
    edges: tuple[tuple[int, str, str], ...] = ()  # axes beyond whose ends it shows something else than here: told
    layer: str = ""  # of an EXR, by its name

    @property
    def channel(self) -> str:
        return self.output if self.output in tuple(CHANNELS) else "r"


@dataclass
class Textures:
    """The textures of a file; `documents` are the finished ones by name."""

    package: Package
    files: PartFiles
    limits: AssetLimits
    notes: Warnings
    documents: dict[str, dict[str, Any]] = field(default_factory=dict)
    _names: dict[str, str] = field(default_factory=dict)
    _images: dict[str, bytes | None] = field(default_factory=dict)
    _baked: dict[tuple[Any, ...], str] = field(default_factory=dict)

    def use(self, picture: Picture, role: Role, charts: list[str]) -> dict[str, Any] | None:
        """A parameter's reference to the texture; None, with a warning, where its image cannot be used. `charts` are
        the texture coordinates that the material uses, and grow to at most two."""
        data = self.image(picture.path, picture.pointer)
        if data is None:
            return None
        if picture.chart not in charts:
            if len(charts) == 2:
                detail = (
                    f"more than two sets of texture coordinates are not supported; {picture.chart[:40]} is not used"
                )
                self.notes.add(picture.pointer, detail)
                return None
            charts.append(picture.chart)
        bands = _bands(data, picture.pointer)
        if role == "scalar" and picture.channel == "a" and "A" not in bands:
            picture = _opaque(picture)
        settings: dict[str, Any] = {"color_space": "linear" if role == "normal" else _space(picture, data, bands)}
        if picture.layer and (layer := self._layer(picture, data)):
            settings["layer"] = layer
        scale, bias = _asked(picture, role)
        factor: dict[str, Any] = {}
        if all(abs(value) < CLOSE for value in bias) and min(scale) >= 0:
            asset = self.files.add(data, picture.pointer)
            if any(abs(value - 1) > CLOSE for value in scale):
                factor = {"factor": scale[0] if len(set(scale)) == 1 else list(scale)}
        else:
            asset = self._bake(
                picture, data, role, scale, bias, settings["color_space"] == "srgb", settings.pop("layer", "")
            )
        wrap = wrap_of(*picture.wrap)
        if wrap != "repeat":
            settings["wrap"] = wrap
        uv = {"uv": charts.index(picture.chart)} if charts.index(picture.chart) else {}
        name = self._name(asset, settings | dict(picture.placing) | uv, picture.path)
        channel = {"channel": picture.channel} if role == "scalar" and picture.channel != "r" else {}
        return {"texture": name, **channel, **factor}

    def image(self, path: str, pointer: str) -> bytes | None:
        """The bytes of an image of the package; None, with a warning, where there is none that is read."""
        if path not in self._images:
            self._images[path] = self._read(path, pointer)
        return self._images[path]

    def _read(self, path: str, pointer: str) -> bytes | None:
        data = self.package.file(path) if path else None
        shown = repr(path.removeprefix(OUTSIDE)[:100])
        if data is None:
            what = "names no file" if not path else f"refers to {shown}, which is not in this file"
            self.notes.add(pointer, f"the texture {what}; the surface is shown without it")
            return None
        image = readable(data, self.limits.max_texels)
        if image is None:
            self.notes.add(pointer, f"the image {posixpath.basename(path)[:60]!r} is in no format that is read")
        return image

    def _layer(self, picture: Picture, data: bytes) -> str:
        """The layer that a picture names; "", with a warning, where its image has none of that name."""
        format = sniff(data)
        assert format is not None  # `_read` takes only what is known
        try:
            parse_image(format, data, self.limits, picture.layer)
        except ParseError as error:
            if error.pointer != LAYER:
                raise
            detail = f"{error.detail}; the image is shown as without this input"
            self.notes.add(f"{picture.pointer}.inputs:layer", detail)
            return ""
        return picture.layer

    def _bake(
        self, picture: Picture, data: bytes, role: Role, scale: Sequence[float], bias: Sequence[float], srgb: bool,
        layer: str,
    ) -> str:  # fmt: skip
        """The reference to an image whose texels are those of `data` times a scale plus a bias, within 0..1."""
        key = picture.path, picture.channel if role == "scalar" else role, tuple(scale), tuple(bias), srgb, layer
        if key in self._baked:
            return self._baked[key]
        format = sniff(data)
        assert format is not None  # `_read` takes only what is known
        texels: Any = parse_image(format, data, self.limits, layer).pixels
        is_8bit = texels.dtype == np.uint8
        values: Any = texels.astype(np.float32) / 255 if is_8bit else texels
        if role == "scalar":
            at = CHANNELS.index(picture.channel)
            values = values[..., [at if at < values.shape[2] else 0]]
        else:
            values = np.repeat(values, 3, axis=2) if values.shape[2] == 1 else values[..., :3]
        if srgb and picture.channel != "a":
            values = decode_srgb(values)
        values = np.clip(values * np.array(scale, np.float32) + np.array(bias, np.float32), 0, 1)
        if srgb and picture.channel != "a":
            values = encode_srgb(values)
        if values.shape[2] == 1:
            values = np.repeat(values, 3, axis=2)  # any channel of it is the one that is asked for
        out = np.rint(values * 255).astype(np.uint8) if is_8bit else values.astype(np.float32)
        self._baked[key] = self.files.add(encode(out, "png", bits=8 if is_8bit else 16), picture.pointer)
        return self._baked[key]

    def _name(self, asset: str, settings: dict[str, Any], path: str) -> str:
        key = asset + repr(sorted(settings.items()))
        if key not in self._names:
            stem = posixpath.splitext(posixpath.basename(path.removeprefix(INSIDE)))[0]
            self._names[key] = unique(stem or "texture", self.documents)
            self.documents[self._names[key]] = {"asset": asset, **settings}
        return self._names[key]


def _asked(picture: Picture, role: Role) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The scale and the bias of the channels that a role reads."""
    if role == "scalar":
        at = CHANNELS.index(picture.channel)
        return picture.scale[at : at + 1], picture.bias[at : at + 1]
    scale, bias = picture.scale[:3], picture.bias[:3]
    if role == "color":
        return scale, bias
    if (picture.scale, picture.bias) == AS_IT_IS:  # a scale that was forgotten: no normal map is meant otherwise
        return AS_IT_IS[0][:3], AS_IT_IS[1][:3]
    # The network makes components within -1..1, the document's normal map has them in 0..1.
    return tuple(value / 2 for value in scale), tuple((value + 1) / 2 for value in bias)


def _opaque(picture: Picture) -> Picture:
    """The picture with the alpha of an image that has none: 1."""
    scale, bias = list(picture.scale), list(picture.bias)
    bias[3], scale[3] = min(max(scale[3] + bias[3], 0.0), 1.0), 0.0
    return replace(picture, output="a", scale=tuple(scale), bias=tuple(bias))


def _space(picture: Picture, data: bytes, bands: str) -> str:
    """The colour space; by UsdPreviewSurface's rule an image of 8 bits with three or four channels is sRGB."""
    if picture.space != "auto":
        return picture.space
    is_deep = sniff(data) == "png" and data[PNG_DEPTH : PNG_DEPTH + 1] == b"\x10"
    return "srgb" if sniff(data) in PILLOW and bands in ("RGB", "RGBA", "P") and not is_deep else "linear"


def _bands(data: bytes, pointer: str) -> str:
    """The channels of an image as Pillow names them; RGB for formats of floats."""
    format = sniff(data)
    if format not in PILLOW:
        return "RGB"
    try:
        image = opened(data, [PILLOW[format]])
    except (OSError, SyntaxError, ValueError):
        raise ParseError("is a broken image", pointer) from None
    bands = "".join(image.getbands())
    return bands + "A" if "transparency" in image.info and "A" not in bands else bands
