"""Maps of a material library -> the document's textures, and the images that these refer to."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from service.formats.formats import sniff
from service.formats.read.archive import Archive
from service.formats.read.image import PILLOW, check_size
from service.formats.read.obj.mtl import Map
from service.formats.read.other_images import NAMED, readable
from service.formats.read.png_chunks import opened
from service.formats.read.raw_mesh import MAX_COORDINATE
from service.formats.read.scenes.names import unique
from service.formats.read.scenes.part_files import PartFiles
from service.formats.read.scenes.warnings import Warnings
from service.formats.types import AssetLimits

CHANNELS = {"r": "r", "g": "g", "b": "b", "m": "a", "l": "r"}  # by -imfchan; any channel of a grey image is luminance
PNG, SIXTEEN = b"\x89PNG\r\n\x1a\n", b"\x10"  # how a file begins, and the depth in its header
SMALL = 64  # texels of a side are enough to tell a normal map from heights
BLUE = 0.15  # how far the mean blue of a normal map lies above red and green, at least; of heights it is 0


@dataclass
class Textures:
    """The textures that materials use; `documents` are the finished ones by name."""

    archive: Archive
    files: PartFiles
    notes: Warnings
    limits: AssetLimits
    documents: dict[str, dict[str, Any]] = field(default_factory=dict)
    _names: dict[tuple[Any, ...], str] = field(default_factory=dict)
    _found: dict[str, bytes | None] = field(default_factory=dict)  # images by path

    def chosen(self, found: Map) -> Map:
        """The map, read so that there is a file of its name; as the format says where there is none."""
        readings = (found, *found.others)
        return next((one for one in readings if self.archive.finder.find(one.source, one.reference)), found)

    def use(self, found: Map, is_color: bool = False) -> str | None:
        """The name of the texture; None, with a warning, where its image is missing or in an unsupported format.

        Alpha is the same in either space: an image of 16 bits with both is one texture."""
        path, image = self._image(found)
        if image is None:
            return None
        self._note_options(found)
        settings: dict[str, Any] = {}
        if image[:8] == PNG and image[24:25] == SIXTEEN:  # those of 8 bits are decoded as their use demands
            settings["color_space"] = "srgb" if is_color else "linear"
        if found.options.get("-clamp", ("off",))[:1] == ("on",):
            settings["wrap"] = "clamp"
        for option, name, default in (("-s", "scale", 1.0), ("-o", "offset", 0.0)):
            values = found.vectors.get(option, (default, default))
            if max(map(abs, values)) > MAX_COORDINATE:
                self.notes.add(found.place, f"the option {option} has a number beyond 1e9 and is ignored")
            elif values != (default, default):
                settings[name] = list(values)
        reference = self.files.add(image, path)
        key = reference, repr(settings)
        if key not in self._names:
            self._names[key] = unique(path.rpartition("/")[2].rpartition(".")[0] or "texture", self.documents)
            self.documents[self._names[key]] = {"asset": reference, **settings}
        return self._names[key]

    def holds(self, found: Map) -> bool:
        """True if the image of a map can be used; warns if not."""
        return self._image(found)[1] is not None

    def channel(self, found: Map, default: str) -> str:
        """The channel from which a number is read: that of -imfchan, or `default`, but "r" in an image without
        alpha."""
        chosen = found.options.get("-imfchan", ("",))[0].lower() if found.options.get("-imfchan") else ""
        channel = CHANNELS.get(chosen, default)
        return "r" if channel == "a" and not self._has_alpha(found) else channel

    def is_normal_map(self, found: Map) -> bool:
        """True if the image of `bump` contains normals, as Blender writes them, instead of heights."""
        from PIL import Image

        image = self._image(found)[1]
        if image is None or sniff(image) not in PILLOW:
            return False
        opened = _opened(image)
        if len(opened.getbands()) < 3:
            return False
        check_size(opened.width, opened.height, self.limits)
        try:
            small = opened.convert("RGB").resize((SMALL, SMALL), Image.Resampling.BOX)
        except (OSError, SyntaxError, ValueError):
            return False  # and the image is left out when it is stored
        red, green, blue = np.asarray(small, np.float64).reshape(-1, 3).mean(axis=0) / 255
        return bool(blue - max(red, green) > BLUE)

    def _has_alpha(self, found: Map) -> bool:
        image = self._image(found)[1]
        if image is None or sniff(image) not in PILLOW:
            return False
        opened = _opened(image)
        return "A" in opened.getbands() or "transparency" in opened.info

    def _image(self, found: Map) -> tuple[str, bytes | None]:
        """The path of a map's image, and the image."""
        path = self.archive.finder.located(found.source, found.reference, place=found.place, notes=self.notes)
        if path is None:
            shown = repr(found.reference[:100])
            self.notes.add(found.place, f"the texture {shown} is not there; the material is shown without it")
            return "", None
        if path not in self._found:
            self._found[path] = self._read(path, found)
        return path, self._found[path]

    def _read(self, path: str, found: Map) -> bytes | None:
        data = readable(self.archive.read(path), self.limits.max_texels, path)
        if data is None:
            shown = repr(found.reference[:100])
            self.notes.add(found.place, f"the texture {shown} is not in a supported format ({NAMED}); left out")
            return None
        if sniff(data, filename=path) in PILLOW and _opened(data) is None:
            self.notes.add(found.place, f"the texture {found.reference[:100]!r} is a broken image; left out")
            return None
        return data

    def _note_options(self, found: Map) -> None:
        if found.vectors.get("-t", (0.0, 0.0)) != (0.0, 0.0):
            self.notes.add(found.place, "turbulence (-t) is not supported and is ignored")
        for option, harmless in (("-cc", "off"), ("-boost", "0"), ("-blendu", "on"), ("-blendv", "on")):
            words = found.options.get(option)
            if words and words[0] != harmless:
                self.notes.add(found.place, f"the option {option} is not supported and is ignored")
        if found.options.get("-mm", ("0", "1")) != ("0", "1"):
            self.notes.add(found.place, "the option -mm is not supported and is ignored")


def _opened(data: bytes) -> Any:
    """An image whose header was read, and nothing else of it; None for one that is broken."""
    try:
        return opened(data, list(PILLOW.values()))
    except (OSError, SyntaxError, ValueError):
        return None
