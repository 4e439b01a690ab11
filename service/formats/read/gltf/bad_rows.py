"""What of a primitive can't be used: its triangles are left out, or its attributes are replaced, with warnings."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from service.formats.read.bad_elements import Namer, are_places, finite_rows, left_out
from service.formats.read.gltf.document import Array
from service.formats.read.gltf.json_view import JsonView
from service.formats.read.gltf.primitives import Primitive
from service.formats.read.scenes.warnings import Warnings

OF_ATTRIBUTE = {
    "NORMAL": ("normals", 0.0, "it is computed"),
    "TANGENT": ("tangents", 0.0, "it is computed"),
    "COLOR_0": ("colors", 1.0, "white is used instead"),
    "TEXCOORD_0": ("uvs", 0.0, "0 0 is used instead"),
    "TEXCOORD_1": ("uvs", 0.0, "0 0 is used instead"),
}


def usable(primitive: Primitive, place: JsonView, notes: Warnings) -> Primitive | None:
    """The primitive with finite numbers only; None where no triangle remains."""
    attributes = place.need("attributes")
    good = are_places(primitive.vertices)
    if not good.all():
        whole = good[primitive.faces].all(axis=1)
        bad = int(np.flatnonzero(~good)[0])
        item = _items(primitive, attributes, "POSITION")(bad)
        reason = f"{item} is not finite or lies beyond 1e9 m: {primitive.vertices[bad].tolist()}"
        notes.leave_out(attributes.at("POSITION"), left_out(int((~whole).sum()), "triangle", reason))
        if not whole.any():
            return None
        primitive = replace(primitive, faces=primitive.faces[whole]).compact()
    for name, rows in list(primitive.detail()):
        member, fill, otherwise = OF_ATTRIBUTE[name]
        told: list[str] = []
        finite = finite_rows(rows, fill, _items(primitive, attributes, name), otherwise, told)
        for detail in told:
            notes.add(attributes.at(name), detail)
            primitive = replace(primitive, **_changed(primitive, member, name, finite))
    return primitive


def _changed(primitive: Primitive, member: str, name: str, rows: Array) -> dict[str, Any]:
    if member != "uvs":
        return {member: rows}
    return {"uvs": tuple(rows if name == f"TEXCOORD_{k}" else uv for k, uv in enumerate(primitive.uvs))}


def _items(primitive: Primitive, attributes: JsonView, name: str) -> Namer:
    """Names a row of an attribute by its place in the file."""
    accessor = attributes.value.get(name)
    of = f" of /accessors/{accessor}" if type(accessor) is int else ""
    return lambda row: f"item {row if primitive.numbers is None else primitive.numbers[row]}{of}"
