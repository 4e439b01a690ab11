"""Measured reflection as the renderer's words: records of the materials, and behind them the tables of each file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from gpu import layout
from gpu.layout.measured_records import COLUMNS_BITS, LIMIT_ANGLES, Measured, MeasuredKind
from gpu.layout.models import NUMBERS
from service.document import Scene
from service.document.material import MeasuredMaterial
from service.formats import Assets, MeasuredData
from service.formats.read.measured.warp import Warp
from service.pack.cache import PackCache, lasting
from service.problems import AssetError, FieldError, InvalidDocument, escaped

MAX_TEXELS = 2**27  # of a texture of 16384 rows on the device
GROUPS = Measured.words // 4
MOST_HALF = 60000.0  # a half ends at 65504


class TexelLimits(Protocol):
    @property
    def max_texels(self) -> int: ...


@dataclass(frozen=True)
class PackedMeasured:
    """`words` (n, 4) uint32 as `gpu.layout.measured_records` says, with a key that is equal where they are."""

    words: np.ndarray
    key: str = ""
    warnings: tuple[str, ...] = ()


def pack_measured(
    scene: Scene, drawn: Scene, assets: Assets, materials: np.ndarray, cache: PackCache | None,
    limits: TexelLimits | None,
) -> PackedMeasured:  # fmt: skip
    """Completes the `layout.Material` records of what is `drawn` of a scene. Raises InvalidDocument, for files of
    what is not drawn as well."""
    loaded = _loaded(scene, _files(scene), assets, limits)
    wanted = _files(drawn)
    if not wanted:
        return PackedMeasured(np.zeros((0, 4), np.uint32))
    found = {asset: loaded[asset] for asset in wanted.values()}
    for i, asset in wanted.items():
        materials[i]["base_color"] = found[asset].albedo
        materials[i]["anisotropic"] = layout.TEXTURED if len(found[asset].phi) > 1 else 0.0
    count = len(drawn.materials)
    keyed = all(map(lasting, found))
    key = f"{count} " + " ".join(f"{i}:{asset}" for i, asset in wanted.items()) if keyed else ""
    if cache is None or not keyed:
        packed = PackedMeasured(_words(count, wanted, found), key)
    else:
        packed = cache.get(("measured", key), lambda: PackedMeasured(_words(count, wanted, found), key))
    names = list(drawn.materials)
    wearer = {asset: names[i] for i, asset in reversed(wanted.items())}
    said = (f"/materials/{escaped(wearer[a])}/asset: {each}" for a, data in found.items() for each in data.warnings)
    return PackedMeasured(packed.words, key, tuple(said))


def keep_measured(before: np.ndarray, after: np.ndarray) -> None:
    """Take what files say into new `layout.Material` records from those before an edit that changed no file."""
    same = after["model"] == NUMBERS["measured"]
    for member in ("base_color", "anisotropic"):
        after[member][same] = before[member][same]


def _files(scene: Scene) -> dict[int, str]:
    """The assets of its measured materials, by the places of these."""
    return {i: m.asset for i, m in enumerate(scene.materials.values()) if isinstance(m, MeasuredMaterial)}


def _loaded(
    scene: Scene, wanted: Mapping[int, str], assets: Assets, limits: TexelLimits | None
) -> dict[str, MeasuredData]:
    """The files of these materials, which fit into the room for texels."""
    names, found, errors = list(scene.materials), dict[str, MeasuredData](), list[FieldError]()
    room = min(MAX_TEXELS, MAX_TEXELS if limits is None else limits.max_texels)
    for i, asset in wanted.items():
        if asset in found:
            continue
        pointer = f"/materials/{escaped(names[i])}/asset"
        try:
            data = assets.measured(asset)
        except AssetError as error:
            errors.append(FieldError(pointer, error.detail))
            continue
        if data.texels > room:
            detail = (
                f"takes {data.texels} texels; this server has room for {room} more in a scene (SUNBOX_MAX_TEXELS)"
            )
            errors.append(FieldError(pointer, detail))
            continue
        room -= data.texels
        found[asset] = data
    if errors:
        raise InvalidDocument(errors)
    return found


def _words(count: int, wanted: Mapping[int, str], found: Mapping[str, MeasuredData]) -> np.ndarray:
    records = np.zeros(count, Measured.dtype)
    tables: list[np.ndarray] = []
    first = count * GROUPS
    for asset, data in found.items():
        record = np.zeros((), Measured.dtype)
        record["thetas"], record["phis"] = len(data.theta), len(data.phi)
        record["symmetry"], record["albedo"] = data.symmetry, data.albedo
        record["kind"] = MeasuredKind.HALF_DIFFERENCE if data.visible is None else MeasuredKind.ADAPTIVE
        record["scale"] = max(1.0, float(data.values.max(initial=0.0)) / MOST_HALF)
        for member, size, words in _tables(data, float(record["scale"])):
            record[member] = first
            if size:
                record[f"{member}_size"] = size
            tables.append(words)
            first += len(words)
        records[[i for i, each in wanted.items() if each == asset]] = record
    return np.concatenate([records.view(np.uint32).reshape(-1, 4), *tables])


def _tables(data: MeasuredData, scale: float) -> Iterator[tuple[str, int, np.ndarray]]:
    """Members of the record, the size of the table over the unit square that each leads to, and its words."""
    yield "angles", 0, _texels(np.concatenate([data.theta, data.phi]))
    if len(data.limits):
        angles = np.linspace(0, 1, LIMIT_ANGLES)
        given = np.linspace(0, 1, len(data.limits))
        yield "limits", 0, _texels(*(np.interp(angles, given, channel) for channel in data.limits.T))
    wraps = data.visible is None  # the angle about the half vector
    yield "values", 0 if wraps else _size(data.values[..., 0]), _colors(data.values, scale, wraps)
    yield "sampling", _size(data.density), _warp(data.density)
    if data.visible is not None and data.facets is not None and data.areas is not None:
        yield "visible", _size(data.visible), _warp(data.visible)
        yield "facets", _size(data.facets), _texels(data.facets, _below(data.facets))
        if data.is_relative:
            yield "areas", _size(data.areas), _texels(data.areas, _below(data.areas))


def _size(table: np.ndarray) -> int:
    rows, columns = table.shape[-2:]
    return int(rows << COLUMNS_BITS | columns)


def _below(table: np.ndarray) -> np.ndarray:
    """At each node what the next row has."""
    return np.concatenate([table[..., 1:, :], table[..., -1:, :]], axis=-2)


def _texels(*columns: np.ndarray) -> np.ndarray:
    """A texel for each number of the first column, with those of the others."""
    out = np.zeros((columns[0].size, 4), np.float32)
    for k, column in enumerate(columns):
        out[:, k] = column.ravel()
    return out.view(np.uint32)


def _colors(values: np.ndarray, scale: float, wraps: bool) -> np.ndarray:
    """A texel for each colour, with the next one of its line; after the last one comes the first where it `wraps`."""
    halves = np.zeros((*values.shape[:-1], 8), np.float16)
    halves[..., :3] = values / np.float32(scale)
    halves[..., :-1, 3:6] = halves[..., 1:, :3]
    halves[..., -1, 3:6] = halves[..., 0 if wraps else -1, :3]
    return halves.reshape(-1, 8).view(np.uint32)


def _warp(density: np.ndarray) -> np.ndarray:
    """A density that is drawn from, for each of the viewer's directions."""
    warp = Warp.of(density.reshape(-1, *density.shape[-2:]))
    slices, rows, columns = warp.density.shape
    lines = np.zeros((slices, rows, 4), np.float32)
    whole = warp.across[..., -1]
    lines[..., 0], lines[..., 1] = warp.down, whole
    lines[:, :-1, 2], lines[:, -1, 2] = whole[:, 1:], whole[:, -1]
    nodes = np.zeros((slices, rows, columns, 4), np.float32)
    for k, table in enumerate((warp.density, _below(warp.density), warp.across, _below(warp.across))):
        nodes[..., k] = table
    return np.concatenate([lines, nodes.reshape(slices, -1, 4)], axis=1).reshape(-1, 4).view(np.uint32)
