"""The KHR_materials_* extensions of a material, by the inputs that it is written with."""

from __future__ import annotations

from typing import Any

from service.document.texture import NormalTexture
from service.exports.gltf.builder import Tree
from service.exports.gltf.material_writer import MaterialWriter
from service.exports.gltf.textures import Plane
from service.formats.surface.gltf import DEFAULTS
from service.formats.surface.gltf_members import ROUGH, ROWS, Row
from service.formats.surface.outputs import Output, Outputs

CHANNELS = "rgba"


def written(of: MaterialWriter, inputs: Outputs) -> Tree:
    """The members of the material's `extensions`."""
    found: dict[str, Tree] = {}
    for name, output in inputs.items():
        row = ROWS.get(name)
        if row is not None and row.extension not in ("", ROUGH):
            found.setdefault(f"KHR_materials_{row.extension}", Tree()).update(_members(of, name, row, output))
    return {
        key: each for name, tree in found.items() if tree for key, each in of.builder.extension(name, tree).items()
    }


def _members(of: MaterialWriter, name: str, row: Row, output: Output) -> Tree:
    value, field = output
    if isinstance(value, NormalTexture):
        normal = of.normal(value, field)
        return {} if normal is None else {row.factor: normal}
    if isinstance(DEFAULTS[name], tuple):
        factor, planes = of.color(value, field)
        made: Tree = {} if factor == DEFAULTS[name] else {row.factor: list(factor)}
        info = of.textures.info((*planes, None), is_srgb=True)
        return made | ({} if info is None else {row.texture: info})
    most = row.high if name == "iridescence_thickness" else 1.0
    share, plane = of.scalar(value, field, CHANNELS.index(row.channel or "r"), most)
    made = {row.factor: share}
    planes_of: Any = tuple(plane if channel == row.channel else None for channel in CHANNELS)
    if name == "anisotropy_strength" and plane is not None:  # whose direction is u
        planes_of = (Plane(value=1.0), Plane(value=0.5), plane, None)
    if (info := of.textures.info(planes_of, is_srgb=False)) is not None:
        made[row.texture] = info
        if name == "iridescence_thickness":  # mix(minimum, maximum, texture) in glTF; ours is its maximum times that
            made["iridescenceThicknessMinimum"] = 0.0
    return made
