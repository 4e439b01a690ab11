"""Textures: images, samplers and KHR_texture_transform, as the contract's `textures`."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

from service.formats.errors import ParseError
from service.formats.formats import sniff
from service.formats.read.gltf import ktx2_images
from service.formats.read.gltf.document import REFUSALS, GltfDocument
from service.formats.read.gltf.json_view import JsonView, number
from service.formats.read.gltf.primitives import UV_SETS
from service.formats.read.other_images import as_png
from service.formats.read.png_chunks import opened
from service.formats.read.scenes.names import unique
from service.formats.read.scenes.warnings import Warnings
from service.formats.read.scenes.wrapping import wrap_of

ColorSpace = Literal["srgb", "linear"]
WRAPS = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
NEAREST = (9728, 9984, 9986)
READ = ("png", "jpeg", "webp")
Charts = tuple[bool, ...]  # whether a mesh has each of its uv sets


@dataclass
class Textures:
    """The textures of a file. `store` stores an image, by its bytes and place, and returns its reference."""

    file: GltfDocument
    notes: Warnings
    store: Callable[[bytes, str], str]
    documents: dict[str, dict[str, Any]] = field(default_factory=dict)
    made: dict[tuple[str, str], list[Any]] = field(default_factory=dict)  # references to images of our own, and more
    _names: dict[tuple[Any, ...], str] = field(default_factory=dict)
    _references: dict[str, str] = field(default_factory=dict)  # to images, by their place
    _decoded: dict[str, bytes] = field(default_factory=dict)  # PNG files made of images, by their place
    _channels: dict[str, str] = field(default_factory=dict)  # of images by their place: as Pillow calls them

    def use(self, info: JsonView | None, space: ColorSpace, charts: Charts) -> str | None:
        """The name of a texture; None, with a warning, where it cannot be used. `charts`: the uv sets of the mesh."""
        if info is None:
            return None
        try:
            return self._used(info, space, charts)
        except REFUSALS:
            raise
        except ParseError as error:
            self.notes.add(error.pointer or info.pointer, f"{error.detail}; the texture is left out")
            return None

    def _used(self, info: JsonView, space: ColorSpace, charts: Charts) -> str | None:
        texture = self.file.follow(info, "index", "textures")
        image = self.image(texture)
        placing = self._placing(info)
        uv = placing.get("uv", 0)
        if image is None:
            return None
        if uv >= UV_SETS:
            self.notes.add(
                info.at("texCoord"), f"TEXCOORD_{uv} is not supported, only 0 and 1; the texture is left out"
            )
            return None
        if not charts[uv]:
            self.notes.add(
                info.pointer, f"a mesh with this material has no TEXCOORD_{uv}; it is shown without the texture"
            )
            return None
        return self.add(image, {"color_space": space, "wrap": self._wrap(texture), **placing}, texture)

    def add(self, image: str, settings: dict[str, Any], named: JsonView) -> str:
        """The name of a texture with these settings; the same ones get the same name."""
        key = image, repr(sorted(settings.items()))
        if key not in self._names:
            self._names[key] = self._name(named)
            self.documents[self._names[key]] = {"asset": image, **settings}
        return self._names[key]

    def source(self, texture: JsonView) -> JsonView | None:
        """The texture's image; None, with a warning, where its format is not read or its file is not there."""
        is_lost = False
        for owner in (*map(texture.extension, ("EXT_texture_webp", ktx2_images.NAME)), texture):
            if owner is not None and "source" in owner:
                image = self.file.follow(owner, "source", "images")
                lost = self.file.lacks(image)
                if not lost:
                    return image
                self.notes.add(image.at("uri"), f"the image {lost[:100]!r} is not there; it is left out")
                is_lost = True
        if is_lost:
            return None
        other = texture.object("extensions")
        names = sorted(other.value) if other else []
        which = f" ({', '.join(names)[:80]})" if names else ""
        self.notes.add(texture.pointer, f"the texture has no image in PNG, JPEG, WebP or KTX2{which} and is left out")
        return None

    def image(self, texture: JsonView) -> str | None:
        """The reference to a texture's image."""
        place = self.source(texture)
        if place is None:
            return None
        if place.pointer not in self._references:
            data = self.data(place)
            if sniff(data) not in READ:
                at = "bufferView" if "bufferView" in place else "uri"
                raise place.error(at, f"is not a PNG, JPEG, WebP or KTX2 image; it begins with {data[:12]!r}")
            self._references[place.pointer] = self.store(data, place.pointer)
        return self._references[place.pointer]

    def channels(self, info: JsonView) -> str:
        """The channels of a texture's image: "L" (grey), "RGB" and "A" joined; "" where no image can be read."""
        try:
            place = self.source(self.file.follow(info, "index", "textures"))
            if place is None:
                return ""
            if place.pointer not in self._channels:
                self._channels[place.pointer] = _channels(self.data(place), place)
        except REFUSALS:
            raise
        except ParseError as error:
            self.notes.add(error.pointer or info.pointer, f"{error.detail}; the texture is left out")
            return ""
        return self._channels[place.pointer]

    def data(self, place: JsonView) -> bytes:
        """The bytes of an image in a format that is READ; those of any other as they are."""
        data = self.file.image(place)
        if sniff(data) in READ:
            return data
        if place.pointer not in self._decoded:
            if data.startswith(ktx2_images.START):
                made = ktx2_images.as_png(data, self.file.limits, place.pointer)
            else:
                made = as_png(data, self.file.limits.max_texels) or data  # which glTF has not, and exporters write
            self._decoded[place.pointer] = made
        return self._decoded[place.pointer]

    def _wrap(self, texture: JsonView) -> str | list[str]:
        """The texture's `wrap`."""
        if "sampler" not in texture:
            return "repeat"
        sampler = self.file.follow(texture, "sampler", "samplers")
        found = []
        for name in ("wrapS", "wrapT"):
            mode = sampler.whole(name, 10497)
            if mode not in WRAPS:
                raise sampler.error(name, f"must be one of {', '.join(map(str, WRAPS))}, not {mode}")
            found.append(WRAPS[mode])
        if sampler.whole("magFilter", 9729) in NEAREST:
            self.notes.add(
                sampler.at("magFilter"),
                "nearest-neighbour filtering is not supported; bilinear filtering is used instead",
            )
        return wrap_of(*found)

    def _placing(self, info: JsonView) -> dict[str, Any]:
        """Scale, rotation, offset and uv set of a texture info, where they are not the defaults.

        glTF's v points down, ours up: with F(u, v) = (u, 1 - v), uv' = o + R S uv becomes F(o + R S F(uv)), whose
        rotation is the opposite.
        """
        transform = info.extension("KHR_texture_transform")
        uv = info.whole("texCoord", 0)
        if transform is None:
            return {"uv": uv} if uv else {}
        uv = transform.whole("texCoord", uv)
        turn = transform.number("rotation", 0.0, -1e6, 1e6)
        x, y = transform.numbers("offset", (0.0, 0.0))
        sx, sy = transform.numbers("scale", (1.0, 1.0))
        c, s = math.cos(turn), math.sin(turn)
        # The specification's matrix in u to the right and v down: (c, s; -s, c).
        placing = {
            "scale": [sx, sy],
            "rotation": math.degrees(turn),
            "offset": [x + s * sy, 1 - y - c * sy],
            "uv": uv,
        }
        defaults = {"scale": [1, 1], "rotation": 0, "offset": [0, 0], "uv": 0}
        return {name: value for name, value in placing.items() if value != defaults[name]}

    def _name(self, texture: JsonView) -> str:
        source = self.source(texture)
        named = (source.text("name") if source else "") or texture.text("name")
        return unique(named or texture.pointer[1:].replace("/", " "), self.documents)


def _channels(data: bytes, place: JsonView) -> str:
    """The channels of an image, from its header."""
    try:
        image = opened(data, [name.upper() for name in READ])
    except (OSError, SyntaxError, ValueError):
        raise ParseError("is a broken image", place.pointer) from None
    transparent = "A" in image.getbands() or "transparency" in image.info
    grey = len(image.getbands()) == 1 and image.mode != "P" and not transparent
    return ("L" if grey else "RGB") + ("A" if transparent else "")


def factor(values: tuple[float, ...]) -> Any:
    """The values as a document writes them: one number where all are the same."""
    return values[0] if len(set(values)) == 1 else [number(one, "") for one in values]
