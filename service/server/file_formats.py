"""What `/v1/info` says of files: which formats are written and read, and what those that are not would need."""

from __future__ import annotations

from typing import Any, get_args

from service.exports import FORMATS
from service.formats.formats import COMPRESSIONS, KINDS, missing
from service.formats.images import animation
from service.views import FileFormat

READ = {
    "meshes": "mesh",
    "scenes": "scene",
    "images": "image",
    "luts": "lut",
    "measured": "measured",
}  # names of lists, by the kind of asset


def told() -> dict[str, Any]:
    return {
        "pictures": list(get_args(FileFormat)),
        "animations": list(animation.FORMATS),
        **{name: [format for format, each in KINDS.items() if each == kind] for name, kind in READ.items()},
        "materials": ["zip", "mtlx"],
        "exports": [name for name, each in FORMATS.items() if each.has_scenes and each.is_provided],
        "compressions": list(COMPRESSIONS),
        "missing": missing(),
    }
