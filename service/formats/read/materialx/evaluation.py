"""Trees as numbers: of texels, and what they are as functions of the coordinates or of one image."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from service.formats.read.materialx.images import Images, texels_of
from service.formats.read.materialx.operations import OPERATIONS, WEIGHTS
from service.formats.surface import trees
from service.formats.surface.trees import CLOSE, PROBES, Tree, Unsupported, walk
from service.formats.types import Doubles, Floats, ImageData

SOBEL = 1 / 16  # the scale of `heighttonormal`, as the library's GLSL has it
GEOMETRY = ("position", "normal", "tangent", "bitangent", "viewdirection", "geomcolor")
FRAME = {"tangent": (1.0, 0.0, 0.0), "bitangent": (0.0, 1.0, 0.0), "normal": (0.0, 0.0, 1.0)}
WRAPS = {"periodic": "repeat", "clamp": "clamp", "mirror": "mirror", "constant": "clamp"}


@dataclass
class Places:
    """Where trees are evaluated: coordinates of a band of texels, and values of images there where they are known.

    `texels[key]` are (n, 4) values of the images of that key; without it an image is read at its coordinates.
    """

    uv: Floats  # (n, 2)
    step: tuple[float, float] = (0.0, 0.0)  # between texels; for derivatives, which 0 refuses
    images: Images | None = None
    texels: dict[int, Floats] = field(default_factory=dict)  # by the identity of the image's tree
    _known: dict[int, Floats] = field(default_factory=dict)

    def value(self, tree: Tree) -> Floats:
        """(n or 1, size). Raises Unsupported, and ParseError for a broken image."""
        found = self._known.get(id(tree))
        if found is None:
            with np.errstate(all="ignore"):
                found = np.asarray(self._evaluated(tree), np.float32)
            if found.shape[1] == 1 and tree.size > 1:
                found = np.repeat(found, tree.size, axis=1)
            self._known[id(tree)] = found
        return found

    def _evaluated(self, tree: Tree) -> Floats:
        if tree.value is not None:
            return tree.value[None, :].astype(np.float32)
        if tree.operation == "texcoord":
            return self.uv if tree.size == 2 else np.pad(self.uv, ((0, 0), (0, tree.size - 2)))
        if tree.operation == "position":  # on the square of the texture
            return np.pad(self.uv, ((0, 0), (0, 1)))
        if tree.operation == "image":
            return self._image(tree)
        if tree.operation == "heighttonormal":
            return self._normal(tree)
        if tree.operation == "unsupported":
            raise Unsupported(tree.texts["why"])
        function = OPERATIONS.get(tree.operation)
        if function is None:
            raise Unsupported(f"the node <{tree.operation[:40]}> is not supported")
        return np.asarray(function({name: self.value(one) for name, one in tree.inputs.items()}, tree))

    def _image(self, tree: Tree) -> Floats:
        texels = self.texels.get(id(tree))
        if texels is None:
            assert self.images is not None
            texels = sampled(self.images.texels(tree), self.value(tree.inputs["texcoord"]), tree)
        if tree.size == 2 and texels.shape[1] == 4:
            return texels[:, :2]
        return texels[:, : tree.size]

    def _normal(self, tree: Tree) -> Floats:
        """A normal map of heights, by central differences over a texel."""
        if not all(self.step):
            raise Unsupported("heights are not supported here")
        height, scale = tree.inputs["in"], self.value(tree.inputs["scale"]) * SOBEL
        slopes = []
        for axis in (0, 1):
            ends = []
            for side in (-0.5, 0.5):
                moved = self.uv.copy()
                moved[:, axis] += side * self.step[axis]
                ends.append(Places(moved, images=self.images).value(height))
            slopes.append((ends[1] - ends[0]) / self.step[axis] * scale)
        n = np.concatenate([*(-np.broadcast_to(s, (len(self.uv), 1)) for s in slopes), np.ones((len(self.uv), 1))], 1)
        return np.asarray(n / np.linalg.norm(n, axis=1, keepdims=True) * 0.5 + 0.5, np.float32)


def sampled(image: ImageData, uv: Floats, tree: Tree) -> Floats:
    """(n, 4) an image at coordinates, bilinearly, by the wrapping that its tree has."""
    height, width = image.pixels.shape[:2]
    wrap = WRAPS.get(tree.texts.get("wrap_u", ""), "repeat"), WRAPS.get(tree.texts.get("wrap_v", ""), "repeat")
    x, y = uv[:, 0] * width - 0.5, (1 - uv[:, 1]) * height - 0.5
    x0, y0 = np.floor(x), np.floor(y)
    fx, fy = (x - x0)[:, None], (y - y0)[:, None]
    is_srgb = tree.texts.get("space") == "srgb"
    if tree.texts.get("filter") == "closest":
        fx, fy = np.round(fx), np.round(fy)
    columns = [_wrapped(x0 + k, width, wrap[0]) for k in (0, 1)]
    rows = [_wrapped(y0 + k, height, wrap[1]) for k in (0, 1)]

    def texels(row: Floats, column: Floats) -> Floats:
        picked = ImageData(image.pixels[row, column][None])
        return texels_of(picked, slice(0, 1), is_srgb)

    top = texels(rows[0], columns[0]) * (1 - fx) + texels(rows[0], columns[1]) * fx
    bottom = texels(rows[1], columns[0]) * (1 - fx) + texels(rows[1], columns[1]) * fx
    return np.asarray(top * (1 - fy) + bottom * fy, np.float32)


def _wrapped(index: Floats, count: int, mode: str) -> np.ndarray:
    whole = np.clip(np.nan_to_num(index), -(2.0**40), 2.0**40).astype(np.int64)
    if mode == "clamp":
        return np.clip(whole, 0, count - 1)
    if mode == "mirror":
        whole = np.mod(whole, 2 * count)
        return np.where(whole < count, whole, 2 * count - 1 - whole)
    return np.mod(whole, count)


def images_in(tree: Tree) -> list[Tree]:
    return [one for one in walk(tree) if one.operation == "image"]


def reads(tree: Tree, *operations: str) -> bool:
    """True if a tree has one of these operations outside of the coordinates of its images."""
    seen, left = set[int](), [tree]
    while left:
        one = left.pop()
        if id(one) in seen:
            continue
        seen.add(id(one))
        if one.operation in operations:
            return True
        if one.operation != "image":
            left += one.inputs.values()
    return False


def cost(tree: Tree) -> int:
    """How much longer a texel takes than an addition of numbers."""
    return sum(_weight(one) * one.size for one in walk(tree))


def _weight(tree: Tree) -> int:
    octaves = tree.inputs.get("octaves")
    times = int(np.clip(octaves.value[0], 1, 16)) if octaves is not None and octaves.value is not None else 1
    return WEIGHTS.get(tree.operation, 1) * times


def fixed(tree: Tree) -> Floats | None:
    """(size,) the value of a tree that reads neither coordinates nor images; None for any other. Raises
    Unsupported."""
    if any(one.operation in ("image", "texcoord", "heighttonormal", *GEOMETRY) for one in walk(tree)):
        return None
    found: Floats = Places(np.zeros((1, 2), np.float32)).value(tree)[0]
    return found


def in_frame(tree: Tree) -> Floats | None:
    """(3,) the value of a tree that is made of the surface's own directions, in their frame; None for any other.
    Raises Unsupported."""
    directions = [one for one in walk(tree) if one.operation in FRAME]
    others = ("image", "texcoord", "heighttonormal", *(one for one in GEOMETRY if one not in FRAME))
    if not directions or any(one.operation in others for one in walk(tree)):
        return None
    known = {id(one): np.array([FRAME[one.operation]], np.float32) for one in directions}
    found: Floats = Places(np.zeros((1, 2), np.float32), _known=known).value(tree)[0]
    return found


def affine(uv: Tree) -> tuple[Doubles, Doubles] | None:
    """The matrix (2, 2) and the offset by which a tree turns the mesh's coordinates into those of an image; None
    where it does something else."""
    if any(one.operation in ("image", *GEOMETRY) for one in walk(uv)):
        return None
    points = np.concatenate([[[0, 0], [1, 0], [0, 1]], np.random.default_rng(1).uniform(-3, 3, (PROBES, 2))])
    found = Places(points.astype(np.float32)).value(uv).astype(np.float64)
    found = np.broadcast_to(found, (len(points), 2))
    offset, matrix = found[0], np.stack([found[1] - found[0], found[2] - found[0]], axis=-1)
    expected = points @ matrix.T + offset
    error = np.abs(found - expected).max()
    return (matrix, offset) if bool(error <= CLOSE * (1 + np.abs(expected).max())) else None


def scaled(position: Tree) -> float | None:
    """The number by which a tree multiplies the position on a surface; None where it does something else."""
    if position.operation == "position":
        return 1.0
    if position.operation not in ("multiply", "divide"):
        return None
    by, scale = fixed(position.inputs["in2"]), scaled(position.inputs["in1"])
    if by is None or scale is None or np.ptp(by) or not by[0]:
        return None
    return scale * float(by[0]) if position.operation == "multiply" else scale / float(by[0])


def factors(tree: Tree, image: Tree) -> tuple[Doubles, list[int]] | None:
    """For a tree that reads one image alone and multiplies its channels: the factor of each of its numbers, and the
    channel; None where it does something else."""

    def values(texels: Doubles) -> Floats:
        place = np.zeros((len(texels), 2), np.float32)
        return Places(place, texels={id(image): texels.astype(np.float32)}).value(tree)

    return trees.factors(tree.size, 4, values)


def bands(width: int, height: int, rows: int) -> Iterator[tuple[slice, Floats]]:
    """The rows of an image from the top, a few at a time, and the coordinates of their texels' centres."""
    u = (np.arange(width, dtype=np.float32) + np.float32(0.5)) / np.float32(width)
    for top in range(0, height, rows):
        here = slice(top, min(top + rows, height))
        v = 1 - (np.arange(here.start, here.stop, dtype=np.float32) + np.float32(0.5)) / np.float32(height)
        yield here, np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2).astype(np.float32)
