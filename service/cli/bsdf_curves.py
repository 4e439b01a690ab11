"""Curves of a material's BSDF over an angle, by kind, and their table."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from gpu import SceneArrays
from service.colorimetry import LUMINANCE

if TYPE_CHECKING:
    from service.worker.in_process import InProcessRenderer

STEP = 0.1  # degrees between two values of a curve
ALBEDO_STEP = 1.0  # degrees; the albedo is smooth, and sampled
ALBEDO_SAMPLES = 1 << 16
SLICE_STEP = 1.0  # degrees, along both axes of a slice
CHANNELS = ("r", "g", "b")


@dataclass(frozen=True)
class Specular:
    """A perfectly specular lobe in a polar diagram."""

    theta: float  # degrees
    weight: tuple[float, ...]  # per channel


@dataclass(frozen=True)
class Curves:
    """`theta` (n,) in degrees, and a column (n,) for each curve; of a slice, `image` is (theta_d, theta_h, 3).
    `lobes` (n, 3) are the requested lobes of the curves, without those that are 0 everywhere."""

    kind: str
    theta: np.ndarray
    columns: dict[str, np.ndarray]
    specular: dict[str, list[Specular]] = field(default_factory=dict)  # by curve
    image: np.ndarray | None = None
    missing: str = ""  # the reason, where there is no curve
    lobes: dict[str, np.ndarray] = field(default_factory=dict)  # "f_45_diffuse"

    @property
    def table_columns(self) -> dict[str, np.ndarray]:
        out = dict(self.columns)
        for name, values in self.lobes.items():
            out |= _channels(name, values)
        return out

    @property
    def notes(self) -> list[str]:
        """Lines about lobes that columns cannot show."""
        return [
            f"{name}: a perfectly specular lobe at {lobe.theta:.1f} degrees reflects or transmits "
            + " ".join(f"{x:.4g}" for x in lobe.weight)
            for name, lobes in self.specular.items()
            for lobe in lobes
        ]


def curves_of(
    renderer: InProcessRenderer, packed: SceneArrays, kind: str, angles: list[float], lobes: bool = False
) -> Curves:
    """The curves of one kind; `lobes` is for "polar". Raises GpuError."""
    return _polar(renderer, packed, angles, lobes) if lobes else KINDS[kind](renderer, packed, angles)


def table(materials: Mapping[str, Curves]) -> str:
    """Comma-separated values: theta_deg, then a column for each curve, with its material where there are two."""
    several = len(materials) > 1
    first = max(materials.values(), key=lambda curves: len(curves.theta))
    columns = {"theta_deg": first.theta}
    for name, curves in materials.items():
        known = np.isin(first.theta, curves.theta)
        for curve, values in curves.table_columns.items():
            column = np.zeros(len(first.theta))  # behind a surface that does not transmit there is no light
            column[known] = values
            columns[f"{_plain(name)}:{curve}" if several else curve] = column
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(f"{x + 0.0:.9g}" for x in row) for row in rows)]
    return "\n".join(lines) + "\n"


def _plain(name: str) -> str:
    """A name without the characters that separate columns and rows."""
    return "".join("_" if c in ',"\r\n' else c for c in name)


def _directions(theta: np.ndarray | float) -> np.ndarray:
    """Unit vectors (n, 3) in the plane of normal and tangent, `theta` degrees from the normal to the tangent."""
    t = np.radians(np.atleast_1d(theta))
    cos = np.where(np.abs(np.atleast_1d(theta)) == 90, 0, np.cos(t))  # else 6e-17, which is above the horizon
    return np.stack([np.sin(t), np.zeros_like(t), cos], axis=1)


def _channels(name: str, values: np.ndarray) -> dict[str, np.ndarray]:
    """(n, 3) as one curve, or as three where the channels differ."""
    if (values == values[:, :1]).all():
        return {name: values[:, 0]}
    return {f"{name}_{channel}": values[:, i] for i, channel in enumerate(CHANNELS)}


def _polar(renderer: InProcessRenderer, material: SceneArrays, angles: list[float], lobes: bool = False) -> Curves:
    """f in the plane of incidence; wo is at -angle, so that a mirror reflects it to +angle. Light beyond 90 degrees
    is transmitted."""
    theta = np.round(np.arange(-1800, 1801) * STEP, 1)
    wo = _directions(-np.array(angles))
    found = renderer.bsdf_values(material, wo, _directions(theta), lobes=lobes)
    above = np.abs(theta) < 90
    clear = bool(found.f[:, ~above].any()) or bool((found.delta_wi[found.delta_probability > 0][:, 2] < 0).any())
    shown = np.ones_like(above) if clear else above
    columns: dict[str, np.ndarray] = {}
    specular: dict[str, list[Specular]] = {}
    parts: dict[str, np.ndarray] = {}
    for i, angle in enumerate(angles):
        name = f"f_{angle:g}"
        columns |= _channels(name, found.f[i, shown])
        lit = {lobe: f[i, shown] for lobe, f in zip(found.lobe_names.tolist(), found.lobes, strict=True) if f.any()}
        parts |= {f"{name}_{lobe}": f for lobe, f in lit.items()}
        for k in np.flatnonzero(found.delta_probability[i] > 0):
            x, _, z = found.delta_wi[i, k].tolist()
            weight = tuple(found.delta_weight[i, k].tolist())
            specular.setdefault(name, []).append(Specular(float(np.degrees(np.arctan2(x, z))), weight))
    return Curves("polar", theta[shown], columns, specular, lobes=parts)


def _albedo(renderer: InProcessRenderer, material: SceneArrays, angles: list[float]) -> Curves:
    theta = np.append(np.arange(0, 90, ALBEDO_STEP), 90 - STEP)
    found = renderer.bsdf_albedo(material, _directions(theta), ALBEDO_SAMPLES)
    return Curves("albedo", theta, _channels("albedo", found.albedo))


def _slice(renderer: InProcessRenderer, material: SceneArrays, angles: list[float]) -> Curves:
    """f over the angle of the half vector to the normal, theta_h, and that of both directions to it, theta_d, in
    planes at right angles [Rusinkiewicz 1998; Burley 2012, figure 1]. Luminance in the columns, one for each theta_d.
    """
    grid = np.arange(0, 90, SLICE_STEP)
    theta_d, theta_h = (np.radians(a.ravel()) for a in np.meshgrid(grid, grid, indexing="ij"))
    half = np.stack([np.sin(theta_h), np.zeros_like(theta_h), np.cos(theta_h)], axis=1)
    across = np.zeros_like(half)
    across[:, 1] = np.sin(theta_d)
    along = half * np.cos(theta_d)[:, None]
    found = renderer.bsdf_values(material, along + across, along - across, paired=True)
    image = found.f[:, 0].reshape(len(grid), len(grid), 3)
    luminance = image.astype(np.float64) @ LUMINANCE
    columns = {f"theta_d_{angle:g}": values for angle, values in zip(grid, luminance, strict=True)}
    return Curves("slice", grid, columns, image=image)


def _distribution(renderer: InProcessRenderer, material: SceneArrays, angles: list[float]) -> Curves:
    theta = np.round(np.arange(900) * STEP, 1)
    found = renderer.bsdf_terms(material, _directions(0.0), _directions(theta))
    missing = "" if found.has_facets.all() else "a perfect mirror has no distribution: it must be at least 0.01"
    return Curves("distribution", theta, {"D": found.distribution}, missing=missing)


def _geometry(renderer: InProcessRenderer, material: SceneArrays, angles: list[float]) -> Curves:
    """G between a direction at -angle and one at theta on the other side of the normal."""
    theta = np.round(np.arange(900) * STEP, 1)
    columns, missing = dict[str, np.ndarray](), ""
    for angle in angles:
        found = renderer.bsdf_terms(material, _directions(angle), _directions(theta))
        columns[f"G_{angle:g}"] = found.geometry
        if not found.has_facets.all():
            missing = "a perfect mirror has no geometry term: it must be at least 0.01"
    return Curves("geometry", theta, columns, missing=missing)


def _fresnel(renderer: InProcessRenderer, material: SceneArrays, angles: list[float]) -> Curves:
    theta = np.round(np.arange(900) * STEP, 1)
    found = renderer.bsdf_terms(material, _directions(0.0), _directions(theta))
    return Curves("fresnel", theta, _channels("F", found.fresnel))


KINDS: dict[str, Callable[[InProcessRenderer, SceneArrays, list[float]], Curves]] = {
    "polar": _polar,
    "distribution": _distribution,
    "geometry": _geometry,
    "fresnel": _fresnel,
    "albedo": _albedo,
    "slice": _slice,
}
