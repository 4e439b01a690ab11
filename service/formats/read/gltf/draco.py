"""KHR_draco_mesh_compression, through Google's library."""

from __future__ import annotations

import numpy as np

from service.formats.read.gltf.accessors import normalised
from service.formats.read.gltf.document import Array, GltfDocument
from service.formats.read.gltf.json_view import JsonView
from service.formats.read.polygons import Longs


def decode(file: GltfDocument, extension: JsonView, attributes: JsonView) -> tuple[dict[str, Array], Longs]:
    """Rows by the name of the attribute, and triangles (m, 3). The library raises ValueError for invalid data."""
    import DracoPy

    data, _ = file.view(extension)
    try:
        decoded = DracoPy.decode(data.tobytes())
    except Exception as error:
        raise extension.error("bufferView", f"does not hold a readable Draco mesh ({str(error)[:100]})") from None
    faces = getattr(decoded, "faces", None)
    if faces is None or not len(faces):
        raise extension.error("bufferView", "holds Draco data without triangles")
    found = {one["unique_id"]: np.asarray(one["data"]) for one in decoded.attributes}
    ids, rows = extension.need("attributes"), {}
    for name in ids.value:
        number = ids.whole(name)
        if number not in found:
            raise ids.error(name, f"is {number}; the Draco data have {sorted(found)}")
        row = found[number].reshape(len(found[number]), -1)
        described = file.follow(attributes, name, "accessors") if name in attributes else None
        rows[name] = normalised(row) if described and described.flag("normalized") else row
    return rows, np.asarray(faces, np.int64).reshape(-1, 3)
