"""The images that a file names, found among the files of the upload only, and read once each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from service.formats.errors import LAYER, ParseError
from service.formats.formats import sniff
from service.formats.read.image import parse_image
from service.formats.read.other_images import NAMED, readable
from service.formats.read.references import Finder, Found, is_absolute
from service.formats.surface.trees import Tree, Unsupported
from service.formats.types import AssetLimits, Floats, ImageData

MOST_BYTES = 1 << 30  # of the decoded images of one upload


@dataclass
class Images:
    """The images of an upload. `finder` knows its files; `read` returns the bytes of one."""

    finder: Finder
    read: Callable[[str], bytes]
    limits: AssetLimits
    _images: dict[str, bytes | None] = field(default_factory=dict)
    _decoded: dict[tuple[str, str], ImageData] = field(default_factory=dict)  # by path and layer
    _bytes: int = 0

    def located(self, reference: str, source: str) -> Found:
        """The image that `source`, a `.mtlx` file, names. Raises Unsupported."""
        shown = repr(reference[:100])
        if "<" in reference:
            raise Unsupported(f"the image {shown} has a token in its name, such as <UDIM>, which is not supported")
        found = self.finder.find(source, reference)
        if found is None and (not reference or is_absolute(reference) or "://" in reference):
            raise Unsupported(f"the image {shown} is not a path inside the upload")
        if found is None:
            raise Unsupported(f"the image {shown} is not in the upload; a zip has a .mtlx file and its images")
        if self.image(found.path) is None:
            raise Unsupported(f"the image {shown} is not in a supported format ({NAMED})")
        return found

    def image(self, path: str) -> bytes | None:
        """The image of a file in a format that textures have; None for any other file."""
        if path not in self._images:
            self._images[path] = readable(self.read(path), self.limits.max_texels, path)
        return self._images[path]

    def check_layer(self, path: str, layer: str) -> None:
        """Raise Unsupported where an image has no such layer."""
        try:
            self.decoded(path, layer)
        except ParseError as error:
            if error.pointer != LAYER:
                raise
            raise Unsupported(error.detail) from None

    def decoded(self, path: str, layer: str = "") -> ImageData:
        """The image of a file, of an EXR perhaps one of its layers. Raises ParseError where it is broken or too
        large."""
        key = path, layer
        if key not in self._decoded:
            data = self.image(path)
            assert data is not None  # `located` has looked
            format = sniff(data, filename=path)
            assert format is not None
            image = parse_image(format, data, self.limits, layer)
            self._bytes += image.pixels.nbytes
            if self._bytes > MOST_BYTES:
                raise Unsupported(f"the images that must be decoded take more than {MOST_BYTES >> 20} MiB")
            self._decoded[key] = image
        return self._decoded[key]

    def texels(self, tree: Tree) -> ImageData:
        """The image of a tree that reads one."""
        return self.decoded(tree.texts["file"], tree.texts["layer"])


def texels_of(image: ImageData, rows: slice, is_srgb: bool, channels: int = 4) -> Floats:
    """(rows * width, 3 or 4) float32 rows of texels, linear; grey images are grey, and alpha is 1 without one."""
    pixels = image.pixels[rows].reshape(-1, image.pixels.shape[2])
    if image.is_8bit:
        values = (LINEAR_OF_BYTE if is_srgb else UNIT_OF_BYTE)[pixels]
        if pixels.shape[1] == 4:
            values[:, 3] = UNIT_OF_BYTE[pixels[:, 3]]
    else:
        values = pixels.astype(np.float32)
        if is_srgb:
            values[:, :3] = linear(values[:, :3])
    if values.shape[1] == 1:
        values = np.repeat(values, 3, axis=1)
    if values.shape[1] == 3 and channels == 4:
        values = np.concatenate([values, np.ones((len(values), 1), np.float32)], axis=1)
    return values


def linear(values: Floats) -> Floats:
    """Linear values of sRGB's (IEC 61966-2-1)."""
    low = np.maximum(values, 0)
    return np.where(low <= 0.04045, low / 12.92, ((low + 0.055) / 1.055) ** 2.4).astype(np.float32)


def srgb_bytes(values: Floats) -> npt.NDArray[np.uint8]:
    """sRGB's bytes of linear values in 0..1, by a table: a step of it is a twentieth of a byte's in the darks."""
    return SRGB_OF_STEP[np.asarray(values * np.float32(STEPS) + np.float32(0.5), np.int32)]


STEPS = (1 << 16) - 1
UNIT_OF_BYTE = (np.arange(256) / 255).astype(np.float32)
LINEAR_OF_BYTE = linear(UNIT_OF_BYTE)
_steps = np.arange(STEPS + 1) / STEPS
_encoded = np.where(_steps <= 0.0031308, 12.92 * _steps, 1.055 * _steps ** (1 / 2.4) - 0.055)
SRGB_OF_STEP = np.round(255 * _encoded).astype(np.uint8)
