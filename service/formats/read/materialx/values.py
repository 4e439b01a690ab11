"""Trees -> what documents hold: numbers, colours and references to textures. An image that is multiplied by a
constant stays as it is; all else that differs from place to place is computed for each texel of an image of our own.
"""

from __future__ import annotations

import math
import posixpath
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from service.formats.images import encode
from service.formats.read.materialx.evaluation import (
    GEOMETRY,
    WRAPS,
    Places,
    affine,
    bands,
    cost,
    factors,
    fixed,
    images_in,
    reads,
)
from service.formats.read.materialx.images import Images, srgb_bytes, texels_of
from service.formats.read.scenes.names import unique
from service.formats.read.scenes.part_files import PartFiles
from service.formats.read.scenes.warnings import Warnings
from service.formats.read.scenes.wrapping import wrap_of
from service.formats.surface.trees import Tree, Unsupported, constant, less, walk
from service.formats.types import Doubles, Floats

BAND = 1 << 15  # texels at a time
PLAIN_SIDE = 1024  # texels of an image of a pattern that reads no image
MOST_SIDE = 4096
# Additions of one number for one texel that one image may take, and those of all images of a file: about 4 and 12 s.
MOST_COST, MOST_TOTAL = 1 << 30, 3 << 30
MOST_IMAGES = 64
NOISES = tuple(f"{kind}{k}d" for kind in ("noise", "fractal", "cellnoise", "worleynoise") for k in (2, 3))
Map = tuple[Doubles, Doubles]  # from the mesh's coordinates to an image's: a matrix and an offset
Together = tuple[Tree, dict[str, Any], Map]
IDENTITY = {"scale": [1.0, 1.0], "rotation": 0.0, "offset": [0.0, 0.0]}


@dataclass
class Values:
    """The values of one upload's materials; `documents` are the textures by name."""

    images: Images
    files: PartFiles
    notes: Warnings
    documents: dict[str, dict[str, Any]] = field(default_factory=dict)
    _names: dict[tuple[Any, ...], str] = field(default_factory=dict)
    _scales: dict[str, list[float]] = field(default_factory=dict)  # of computed images, whose texels are at most 1
    _computed: list[Tree] = field(default_factory=list)  # kept, so that their identities stay theirs
    _spent: int = 0

    def number(self, tree: Tree, place: str, low: float = 0.0, high: float = 1.0) -> Any:
        """A number within a range, or a reference to a texture's channel. Raises Unsupported."""
        value = fixed(tree)
        if value is not None:
            return self._clamped(value, place, low, high)[0]
        return self._reference(tree, place, low, high)

    def color(self, tree: Tree, place: str, high: float = 1.0) -> Any:
        """A colour, or a reference to a texture. Raises Unsupported."""
        value = fixed(tree)
        if value is not None:
            found = self._clamped(value, place, 0.0, high)
            return found[0] if len(set(found)) == 1 else found
        return self._reference(tree, place, 0.0, high)

    def normal(self, tree: Tree, place: str) -> dict[str, Any] | None:
        """The normal map of a tree that an input for normals is connected to; None where that bends nothing. Raises
        Unsupported."""
        if tree.operation != "normalmap":
            raise Unsupported("a normal that is no normal map is not supported")
        scales = fixed(tree.inputs["scale"])
        if scales is None or scales.min() < 0:
            raise Unsupported("a strength that is negative or differs from place to place is not supported")
        if scales.max() != scales.min():
            self.notes.add(place, "different strengths in u and v are not supported; that of u is used for both")
        source = tree.inputs["in"]
        if fixed(source) is not None:
            return None  # the same everywhere: flat, but for those that tilt a whole surface
        found = self._plain(source)
        if found is None or found[1:] != ([1.0, 1.0, 1.0], [0, 1, 2]):
            found = self._bake(source, place, 0.0, 1.0, "normals"), [1.0] * 3, [0, 1, 2]
        scale = float(scales[0])
        return {"texture": found[0]} | ({"scale": round(scale, 6)} if scale != 1 else {})

    def height(self, tree: Tree, place: str) -> dict[str, Any] | None:
        """Heights in metres; None where all are equal. The texture's value at which the tree is 0 is the midlevel.
        Raises Unsupported."""
        if fixed(tree) is not None:
            return None
        images = images_in(tree)
        black = Places(np.zeros((1, 2), np.float32), texels={id(one): np.zeros((1, 4), np.float32) for one in images})
        if len(images) != 1 or reads(tree, "texcoord", "heighttonormal", *GEOMETRY):
            raise Unsupported("heights other than an image times a number and less another are not supported")
        base = float(black.value(tree)[0, 0])
        found = self._plain(less(tree, constant(base)))
        if found is None or found[1][0] == 0:
            raise Unsupported("heights other than an image times a number and less another are not supported")
        name, (scale,), (channel,) = found
        return {
            "texture": name, "channel": "rgba"[channel], "scale": float(f"{scale:.7g}"),
            "midlevel": float(f"{-base / scale:.6g}") + 0.0,
        }  # fmt: skip

    def _clamped(self, value: Floats, place: str, low: float, high: float) -> list[float]:
        if not np.isfinite(value).all():
            raise Unsupported("its value is not a finite number")
        inside = np.clip(value, low, high)
        if np.abs(inside - value).max() > 1e-6:
            nearest = ", ".join(f"{one:g}" for one in sorted(set(inside[inside != value].tolist())))
            self.notes.add(place, f"values beyond {low:g}..{high:g} are not supported; {nearest} is used instead")
        return [float(f"{one:.7g}") for one in inside.tolist()]

    def _reference(self, tree: Tree, place: str, low: float, high: float) -> dict[str, Any]:
        found = self._plain(tree)
        if found is not None and min(found[1]) >= 0:
            name, by, channels = found
        else:
            name, by, channels = self._bake(tree, place, low, high), [1.0] * tree.size, list(range(tree.size))
            by = self._scales.get(name, by)
        if tree.size == 1:
            channel = {} if name in self._scales else {"channel": "rgba"[channels[0]]}
            return {"texture": name, **channel} | ({"factor": by[0]} if by[0] != 1 else {})
        grey = {"channel": "rgba"[channels[0]]} if len(set(channels)) == 1 and tree.size > 1 else {}
        factor = by[0] if len(set(by)) == 1 else by
        return {"texture": name, **grey} | ({"factor": factor} if factor != 1 else {})

    def _plain(self, tree: Tree) -> tuple[str, list[float], list[int]] | None:
        """The texture, the factors and the channels of a tree that is an image times a constant."""
        images = images_in(tree)
        if len(images) != 1 or reads(tree, "texcoord", "heighttonormal", *GEOMETRY):
            return None
        image = images[0]
        placing = _placing(affine(image.inputs["texcoord"]))
        found = factors(tree, image)
        if placing is None or found is None:
            return None
        by, channels = found
        is_grey = len(set(channels)) == 1
        if not is_grey and channels != list(range(tree.size)):
            return None  # channels change places
        if 3 in channels and not self._has_alpha(image):
            return None
        layer = {"layer": image.texts["layer"]} if image.texts["layer"] else {}
        settings = {"color_space": image.texts["space"]} | layer | self._settings(image) | placing
        key = image.texts["file"], repr(settings)
        if key not in self._names:
            file = image.texts["file"]
            data = self.images.image(file)
            assert data is not None  # it was located
            asset = self.files.add(data, file)
            self._names[key] = self._named(file, {"asset": asset, **settings})
        return self._names[key], [float(f"{one:.7g}") for one in by.tolist()], channels

    def _has_alpha(self, image: Tree) -> bool:
        return bool(self.images.texels(image).pixels.shape[2] == 4)

    def _settings(self, image: Tree) -> dict[str, Any]:
        """The wrapping and the mapping of an image, where they are not the usual ones."""
        u, v = (WRAPS.get(image.texts[name], "repeat") for name in ("wrap_u", "wrap_v"))
        mapping = image.texts.get("mapping", "uv")
        wrap = wrap_of(u, v)
        return ({} if wrap == "repeat" else {"wrap": wrap}) | ({} if mapping == "uv" else {"mapping": mapping})

    def _named(self, file: str, document: dict[str, Any]) -> str:
        name = unique(posixpath.splitext(posixpath.basename(file))[0] or "texture", self.documents)
        self.documents[name] = document
        return name

    def _bake(self, tree: Tree, place: str, low: float, high: float, kind: str = "") -> str:
        """The name of a texture whose texels are the tree's values there, divided by their largest where that is
        beyond 1. Raises Unsupported."""
        key = "baked", id(tree), low, high
        if key in self._names:
            return self._names[key]
        self._computed.append(tree)
        if len(self._computed) > MOST_IMAGES:
            raise Unsupported(f"more than {MOST_IMAGES} graphs would have to be computed as images")
        for one in walk(tree):
            if one.operation == "unsupported":
                raise Unsupported(one.texts["why"])
        together = self._together(tree)
        texels, wanted = self._texels(tree, together)
        least, most = float(texels.min()), float(texels.max())
        if not low - 1e-3 <= least <= most <= high + 1e-3:  # NaN is beyond them as well
            if kind != "normals":
                self.notes.add(place, f"values beyond {low:g}..{high:g} are not supported and are clamped")
            np.nan_to_num(texels, copy=False, nan=low)
        np.clip(texels, low, high, out=texels)
        scale = max(min(most, high), 1.0)
        document: dict[str, Any] = {"color_space": "linear"}
        if together is not None:
            document |= self._settings(together[0]) | together[1]
        if scale != 1:
            texels /= np.float32(scale)
        is_color = tree.size >= 3 and kind != "normals"
        if is_color:
            document["color_space"] = "srgb"
        is_fine = wanted == 16 and tree.size == 1
        stored: np.ndarray = srgb_bytes(texels[..., :3]) if is_color else texels[..., : 1 if is_fine else 3]
        data = encode(np.ascontiguousarray(stored), "png", bits=16 if is_fine else 8)
        asset = self.files.add(data, place)
        self._names[key] = self._named(place.rpartition("/")[2], {"asset": asset, **document})
        self._scales[self._names[key]] = [scale] * tree.size
        where = "" if together is not None else ", which repeats with each unit of the coordinates"
        size = f"{texels.shape[1]} x {texels.shape[0]}"
        self.notes.add(place, f"the graph is computed as an image of {size} texels{where}")
        if reads(tree, "position") or (together is None and any("mapping" in one.texts for one in images_in(tree))):
            self.notes.add(place, "a pattern in space is not supported; it lies in the texture's coordinates instead")
        return self._names[key]

    def _together(self, tree: Tree) -> Together | None:
        """An image, its placing and that as a map, where all that differs from place to place are images that lie as
        it does."""
        if reads(tree, "texcoord", "heighttonormal", *GEOMETRY):
            return None
        images = images_in(tree)
        placed = [(affine(one.inputs["texcoord"]), self._settings(one)) for one in images]
        first = placed[0]
        for map, settings in placed:
            if map is None or first[0] is None or settings != first[1]:
                return None
            if not all(np.allclose(a, b, atol=1e-6) for a, b in zip(map, first[0], strict=True)):
                return None
        placing = _placing(first[0])
        return None if placing is None or first[0] is None else (images[0], placing, first[0])

    def _texels(self, tree: Tree, together: Together | None) -> tuple[Floats, int]:
        """(height, width, size) the values, and the bits that a channel deserves."""
        images = images_in(tree)
        width, height, bits = self._size(tree, images)
        price = max(cost(tree), 1)
        share = MOST_COST / (price * width * height)
        if share < 1:
            width, height = (max(int(side * math.sqrt(share)), 64) for side in (width, height))
        self._spent += price * width * height
        if self._spent > MOST_TOTAL:
            raise Unsupported("all graphs of the file take too long to compute as images")
        out = np.empty((height, width, tree.size), np.float32)
        for rows, uv in bands(width, height, max(BAND // width, 1)):
            places = Places(uv, (1 / width, 1 / height), self.images)
            if together is not None:
                moved = {id(one): self._picked(one, rows, (width, height)) for one in images}
                places.texels |= {key: found for key, found in moved.items() if found is not None}
                if len(places.texels) < len(images):
                    places.uv = _unplaced(uv, together[2])
            out[rows] = np.broadcast_to(places.value(tree), (len(uv), tree.size)).reshape(-1, width, tree.size)
        return out, bits

    def _picked(self, image: Tree, rows: slice, size: tuple[int, int]) -> Floats | None:
        """An image's own texels, where the image to be made has as many."""
        decoded = self.images.texels(image)
        if decoded.pixels.shape[1::-1] != size:
            return None
        return texels_of(decoded, rows, image.texts["space"] == "srgb", image.size)

    def _size(self, tree: Tree, images: list[Tree]) -> tuple[int, int, int]:
        """Width and height of the image to be made: those of the largest that it reads; and bits of a channel."""
        sides, bits = [], 8
        for one in images:
            decoded = self.images.texels(one)
            sides.append(decoded.pixels.shape[1::-1])
            bits = max(bits, 8 if decoded.is_8bit else 16)
        if reads(tree, *NOISES) or not sides:
            sides.append((PLAIN_SIDE, PLAIN_SIDE))
            bits = 16 if not images else bits
        width, height = max(sides, key=lambda side: side[0] * side[1])
        return min(width, MOST_SIDE), min(height, MOST_SIDE), bits


def _unplaced(uv: Floats, map: Map) -> Floats:
    """The mesh's coordinates at which an image that lies so is read at `uv`."""
    matrix, offset = map
    if abs(np.linalg.det(matrix)) < 1e-12:
        raise Unsupported("coordinates that have no inverse are not supported")
    return np.asarray((uv - offset) @ np.linalg.inv(matrix).T, np.float32)


def _placing(map: Map | None) -> dict[str, Any] | None:
    """Scale, rotation and offset of a texture, whose matrix is the rotation times the scale; None where the matrix
    is no such product."""
    if map is None:
        return None
    matrix, offset = map
    first, second = matrix[:, 0], matrix[:, 1]
    long = float(np.hypot(*first)), float(np.hypot(*second))
    if min(long) < 1e-9 or abs(float(first @ second)) > 1e-5 * long[0] * long[1]:
        return None
    mirrored = -1.0 if np.linalg.det(matrix) < 0 else 1.0
    turn = math.degrees(math.atan2(first[1], first[0]))
    scale = [long[0], mirrored * long[1]]
    if abs(abs(turn) - 180) < 1e-4:
        turn, scale = 0.0, [-scale[0], -scale[1]]
    placing = {"scale": scale, "rotation": turn, "offset": offset.tolist()}
    rounded = {
        name: round(value, 6) + 0.0 if isinstance(value, float) else [round(one, 6) + 0.0 for one in value]
        for name, value in placing.items()
    }
    return {name: value for name, value in rounded.items() if value != IDENTITY[name]}
