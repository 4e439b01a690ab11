"""The document's textures as glTF's: original bytes where glTF reads from them what the document does, else PNG."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from service.document import Scene
from service.document.texture import (
    CheckerTexture,
    ColorTexture,
    ImageTexture,
    NormalTexture,
    Reference,
    is_projected,
)
from service.exports.gltf import pixels
from service.exports.gltf.builder import Builder, Tree
from service.exports.losses import Losses
from service.exports.writing import Files, Limits
from service.formats import ImageData, at_fault
from service.formats.formats import sniff
from service.problems import AssetError, FieldError, InvalidDocument, TooLarge, escaped

WRAPS = {"repeat": 10497, "clamp": 33071, "mirror": 33648}
LINEAR, MIPMAPS = 9729, 9987  # filters: between texels, and between levels as well
MIMES = {"png": "image/png", "jpeg": "image/jpeg"}
ALPHA = 3


@dataclass(frozen=True)
class Plane:
    """The source of one channel of a glTF texture: a channel of a document's texture, or a number within 0..1."""

    reference: Reference | None = None
    channel: int = 0
    value: float = 1.0
    pointer: str = ""  # to the parameter


Planes = tuple[Plane | None, Plane | None, Plane | None, Plane | None]  # None: nobody reads this channel


@dataclass
class Textures:
    scene: Scene
    builder: Builder
    files: Files
    limits: Limits
    losses: Losses
    _images: dict[Any, int] = field(default_factory=dict)
    _samplers: dict[tuple[str, str], int] = field(default_factory=dict)
    _textures: dict[tuple[int, int], int] = field(default_factory=dict)
    _pixels: dict[str, ImageData] = field(default_factory=dict)
    _texels: int = 0  # of computed images

    def info(self, planes: Planes, is_srgb: bool) -> Tree | None:
        """A texture info for these four channels; None where there is nothing to read. `is_srgb`: the encoding that
        glTF prescribes for the first three. Raises InvalidDocument, TooLarge."""
        planes = self._together(planes)
        first = next((plane.reference for plane in planes if plane and plane.reference), None)
        if first is None:
            return None
        placing = self._texture(first)
        image = self._original(planes, is_srgb)
        if image is None:
            image = self._computed(planes, is_srgb)
        wraps = placing.wraps if isinstance(placing, ImageTexture) else ("repeat", "repeat")
        if wraps not in self._samplers:
            u, v = (WRAPS[wrap] for wrap in wraps)
            sampler = {"magFilter": LINEAR, "minFilter": MIPMAPS, "wrapS": u, "wrapT": v}
            self._samplers[wraps] = self.builder.add("samplers", sampler)
        key = image, self._samplers[wraps]
        if key not in self._textures:
            texture = {"sampler": key[1], "source": image, "name": first.texture}
            self._textures[key] = self.builder.add("textures", texture)
        return {"index": self._textures[key], **self._placed(placing)}

    def plane(self, reference: Reference, channel: int, pointer: str) -> Plane:
        """The plane that is read into a channel of a glTF texture, by default from the same channel."""
        named = None if isinstance(reference, NormalTexture) else reference.channel
        return Plane(reference, channel if named is None else "rgba".index(named), pointer=pointer)

    def has_alpha(self, reference: Reference) -> bool:
        texture = self._texture(reference)
        return isinstance(texture, ImageTexture) and self._image(reference).pixels.shape[2] == 4

    def _texture(self, reference: Reference) -> Any:
        return self.scene.textures[reference.texture]

    def _image(self, reference: Reference) -> ImageData:
        texture = self._texture(reference)
        try:
            if texture.content not in self._pixels:
                self._pixels[texture.content] = self.files.image(texture.asset, texture.layer or "")
            return self._pixels[texture.content]
        except AssetError as error:
            pointer = at_fault(error.place, f"/textures/{escaped(reference.texture)}/asset")
            raise InvalidDocument([FieldError(pointer, error.detail)]) from None

    def _together(self, planes: Planes) -> Planes:
        """The planes without textures that cannot share an image with the first one: glTF reads them all from one."""
        first: Plane | None = None
        chosen: list[Plane | None] = []
        for plane in planes:
            if plane is None or plane.reference is None:
                chosen.append(plane)
                continue
            texture = self._texture(plane.reference)
            if not isinstance(texture, ImageTexture | CheckerTexture):
                self.losses.add(plane.pointer, "textures of this kind have no place in glTF; its factor is written")
                chosen.append(Plane(pointer=plane.pointer))
            elif is_projected(texture):
                detail = f"glTF has texture coordinates alone, and none by {texture.mapping}; its factor is written"
                self.losses.add(plane.pointer, detail)
                chosen.append(Plane(pointer=plane.pointer))
            elif first is None or self._placed(self._texture(first.reference)) == self._placed(texture):  # type: ignore[arg-type]
                first = first or plane
                chosen.append(plane)
            else:
                detail = (
                    "glTF reads it from one image with another texture, which lies elsewhere; its mean is written"
                )
                self.losses.add(plane.pointer, detail)
                chosen.append(Plane(value=float(self._stored(plane, False)[0].mean()) / 255, pointer=plane.pointer))
        return chosen[0], chosen[1], chosen[2], chosen[3]

    def _is_srgb(self, reference: Reference) -> bool:
        texture = self._texture(reference)
        if isinstance(texture, ImageTexture) and texture.color_space is not None:
            return texture.color_space == "srgb"
        is_color = isinstance(reference, ColorTexture)
        return is_color and isinstance(texture, ImageTexture) and self._image(reference).is_8bit

    def _original(self, planes: Planes, is_srgb: bool) -> int | None:
        """The image that holds all planes as it is; None where there is none that glTF takes."""
        asset, channels = None, 0
        for k, plane in enumerate(planes):
            if plane is None:
                continue
            if plane.reference is None:
                if k == ALPHA and plane.value == 1 and channels in (1, 3):
                    continue
                return None
            texture = self._texture(plane.reference)
            if not isinstance(texture, ImageTexture) or asset not in (None, texture.asset):
                return None
            asset, channels = texture.asset, self._image(plane.reference).pixels.shape[2]
            is_grey = channels == 1 and k != ALPHA and plane.channel != ALPHA
            if plane.channel != k and not is_grey:
                return None
            if k != ALPHA and self._is_srgb(plane.reference) != is_srgb:
                return None
        if asset is None:
            return None
        if asset not in self._images:
            try:
                data = self.files.read(asset)
            except AssetError:
                return None
            mime = MIMES.get(sniff(data) or "")
            if mime is None:
                return None
            self._images[asset] = self.builder.add(
                "images", {"mimeType": mime, "bufferView": self.builder.view(data)}
            )
        return self._images[asset]

    def _computed(self, planes: Planes, is_srgb: bool) -> int:
        key = (is_srgb, *map(self._key, planes))
        if key in self._images:
            return self._images[key]
        stored = [self._stored(plane, is_srgb and k != ALPHA) if plane else None for k, plane in enumerate(planes)]
        found = [each for each in stored if each is not None]
        height, width = (max(texels.shape[axis] for texels, _ in found) for axis in (0, 1))
        self._texels += height * width
        if self._texels > self.limits.max_texels:
            detail = (
                f"Its textures must be computed anew: more than {self.limits.max_texels} texels (SUNBOX_MAX_TEXELS)."
            )
            raise TooLarge(detail)
        out: list[np.ndarray | None] = []
        for plane, each in zip(planes, stored, strict=True):
            if each is None or plane is None:
                out.append(None)
                continue
            texels, is_same = each
            if not is_same:
                self.losses.add(plane.pointer, "its image is written anew with 8 bits, which rounds it")
            if texels.shape not in ((1, 1), (height, width)):
                self.losses.add(
                    plane.pointer, f"its image is scaled to {width} x {height}, as another of one texture is"
                )
                texels = pixels.resized(texels, height, width)
            out.append(np.broadcast_to(texels, (height, width)))
        blank = np.broadcast_to(np.uint8(255), (height, width))
        data = pixels.png([blank if each is None else each for each in (out if out[ALPHA] is not None else out[:3])])
        self._images[key] = self.builder.add(
            "images", {"mimeType": "image/png", "bufferView": self.builder.view(data)}
        )
        return self._images[key]

    def _key(self, plane: Plane | None) -> Any:
        if plane is None or plane.reference is None:
            return None if plane is None else plane.value
        texture = self._texture(plane.reference)
        if isinstance(texture, ImageTexture):
            return texture.content, plane.channel, self._is_srgb(plane.reference)
        return texture.a, texture.b, plane.channel

    def _stored(self, plane: Plane, wants_srgb: bool) -> tuple[np.ndarray, bool]:
        """(h, w) bytes of a plane in the wanted encoding, (1, 1) of a number; and whether nothing is rounded."""
        if plane.reference is None:
            return np.full((1, 1), pixels.constant(plane.value, wants_srgb), np.uint8), True
        texture = self._texture(plane.reference)
        if isinstance(texture, CheckerTexture):
            detail = f"the checker is painted as an image of {pixels.CHECKER} x {pixels.CHECKER} texels"
            self.losses.add(f"/textures/{escaped(plane.reference.texture)}", detail)
            k = min(plane.channel, 2)
            ends = [pixels.constant(min(each[k], 1.0), wants_srgb) for each in (texture.a, texture.b)]
            return np.array(ends, np.uint8)[pixels.checker()], True
        image = self._image(plane.reference)
        is_srgb = plane.channel != ALPHA and self._is_srgb(plane.reference)
        return pixels.encoded(pixels.channel(image, plane.channel), is_srgb, wants_srgb)

    def _placed(self, texture: Any) -> Tree:
        """The members of a texture info that say where the image lies: the inverse of what the importer does.

        glTF's v points down: with F(u, v) = (u, 1 - v), uv' = o + R S uv is F(F(o) ... ) about the other corner.
        """
        if isinstance(texture, CheckerTexture):
            scale, rotation, offset, uv = (texture.scale[0] / 2, texture.scale[1] / 2), 0.0, (0.0, 0.0), 0
        else:
            scale, rotation, offset, uv = texture.scale, texture.rotation, texture.offset, texture.uv
        chart = {"texCoord": uv} if uv else {}
        if (*scale, rotation, *offset) == (1, 1, 0, 0, 0):
            return chart
        turn = math.radians(math.fmod(rotation, 360.0))
        c, s = math.cos(turn), math.sin(turn)
        x, y = offset[0] - s * scale[1], 1 - offset[1] - c * scale[1]
        given: Sequence[tuple[str, Any, Any]] = (
            ("offset", [x, y], [0, 0]), ("rotation", turn, 0), ("scale", list(scale), [1, 1]),
        )  # fmt: skip
        transform = {name: value for name, value, default in given if value != default}
        return chart | {"extensions": self.builder.extension("KHR_texture_transform", transform)}
