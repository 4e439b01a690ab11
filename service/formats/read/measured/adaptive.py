"""The files of the RGL database: reflection over an adaptive parameterization, which is dense where the surface's own
facets reflect [Dupuy & Jakob 2018, "An adaptive parameterization for efficient material acquisition and rendering"].

`vndf` is the density of the facets that a viewer sees, over the unit square; its map takes places on another unit
square to facets, and `spectra` or `rgb` is by these places. The reflection times the cosine of the light's angle is
that value times `ndf` over 4 `sigma`.
"""

from __future__ import annotations

import numpy as np

from service.colorimetry import SPAN, reflected_color
from service.formats.errors import ParseError
from service.formats.read.measured import energy
from service.formats.read.measured.directions import area_of, from_angles, mirrored, phi_of, theta_of
from service.formats.read.measured.tensor_file import parse_tensor_file
from service.formats.read.measured.warp import Warp, bilinear
from service.formats.types import AssetLimits, Doubles, Floats, MeasuredData

MOST_SLICES, MOST_SIDE, MOST_WAVELENGTHS = 4096, 1024, 2048
MOST_VALUE = 1e6
PLACES = 48  # along each side, of sums over directions
_SYMMETRIES = (1, 2, 4)


def parse_adaptive(data: bytes | memoryview, limits: AssetLimits) -> MeasuredData:
    """Raises ParseError."""
    found = _Fields(parse_tensor_file(data))
    theta, phi = found.angles("theta_i", np.pi / 2), found.angles("phi_i", np.pi, -np.pi)
    slices = (len(phi), len(theta))
    if len(phi) * len(theta) > MOST_SLICES:
        raise ParseError(f"{len(phi)} x {len(theta)} directions of the viewer; at most {MOST_SLICES} are allowed")
    symmetry = _symmetry(phi)
    facets, areas = found.grid("ndf", ()), found.grid("sigma", ())
    visible, density = found.grid("vndf", slices), found.grid("luminance", slices)
    texels = visible.size + facets.size + areas.size + 2 * density.size
    if texels > limits.max_texels:
        raise ParseError(f"its tables have {texels} entries; {limits.max_texels} are allowed (SUNBOX_MAX_TEXELS)")
    values = _colors(found, slices)
    if values.shape[:-1] != density.shape:
        raise ParseError(f"its colours are by {values.shape[:-1]} places, but `luminance` by {density.shape}")
    jacobian = found.arrays.get("jacobian")
    is_relative = jacobian is None or bool(jacobian.ravel()[:1].any())
    made = MeasuredData(
        values, theta, phi, density, np.zeros((0, 3), np.float32), (0.0, 0.0, 0.0), visible, facets, areas,
        symmetry, is_relative,
    )  # fmt: skip
    angles = theta.astype(np.float64)
    albedo = _albedo(made)
    return MeasuredData(
        **vars(made) | {
            "limits": energy.limits(angles, albedo),
            "albedo": energy.mean_albedo(angles, albedo),
            "warnings": tuple(energy.warnings(angles, albedo)),
        }
    )  # fmt: skip


class _Fields:
    """The arrays of a file, checked."""

    def __init__(self, arrays: dict[str, np.ndarray]) -> None:
        self.arrays = arrays

    def floats(self, name: str, axes: int) -> np.ndarray:
        array = self.arrays.get(name)
        if array is None:
            raise ParseError(f"the array {name!r} is missing")
        if array.dtype != np.dtype("<f4") or array.ndim != axes:
            raise ParseError(f"the array {name!r} must be of 32-bit floats along {axes} axes")
        if not np.isfinite(array).all():
            raise ParseError(f"the array {name!r} has a number that is infinite or none")
        return array

    def angles(self, name: str, most: float, least: float = 0.0) -> Floats:
        array = self.floats(name, 1)
        inside = array.size and (array >= least - 1e-3).all() and (array <= most + 1e-3).all()
        if not inside or (np.diff(array) <= 0).any():
            raise ParseError(f"the array {name!r} must be angles that grow, from {least:.3f} to {most:.3f}")
        return array

    def grid(self, name: str, slices: tuple[int, ...]) -> Floats:
        """A table over the unit square for each of the viewer's directions, not negative."""
        array = self.floats(name, 2 + len(slices))
        if array.shape[: len(slices)] != slices:
            raise ParseError(f"the array {name!r} must be by {' x '.join(map(str, slices))} directions of the viewer")
        if not all(2 <= side <= MOST_SIDE for side in array.shape[-2:]):
            raise ParseError(f"the array {name!r} must have 2 to {MOST_SIDE} entries a side")
        if (array < 0).any():
            raise ParseError(f"the array {name!r} has a negative number")
        return array


def _symmetry(phi: Floats) -> int:
    """The parts of the circle of which the viewer's directions cover one."""
    if len(phi) <= 2:
        return 1
    parts = round(2 * np.pi / float(phi[-1] - phi[0]))
    if parts not in _SYMMETRIES:
        span = np.degrees(phi[-1] - phi[0])
        raise ParseError(f"'phi_i' covers {span:.0f} degrees; 360, 180 and 90 are supported")
    return parts


def _colors(found: _Fields, slices: tuple[int, int]) -> Floats:
    """Linear Rec.709 values (phi, theta, rows, columns, 3). What lies outside of its gamut is taken to its edge."""
    name = "rgb" if "rgb" in found.arrays else "spectra"
    array = found.floats(name, 5)
    if array.shape[:2] != slices or not all(2 <= side <= MOST_SIDE for side in array.shape[-2:]):
        raise ParseError(f"the array {name!r} has the wrong shape, {' x '.join(map(str, array.shape))}")
    if name == "rgb":
        if array.shape[2] != 3:
            raise ParseError(f"the array 'rgb' has {array.shape[2]} channels; it must have 3")
        colors = np.moveaxis(array, 2, -1)
    else:
        wavelengths = found.floats("wavelengths", 1).astype(np.float64)
        if len(wavelengths) != array.shape[2] or len(wavelengths) > MOST_WAVELENGTHS:
            raise ParseError(
                f"the array 'spectra' has {array.shape[2]} wavelengths, 'wavelengths' {len(wavelengths)}"
            )
        if (np.diff(wavelengths) <= 0).any() or wavelengths[0] > SPAN[0] or wavelengths[-1] < SPAN[1]:
            raise ParseError(f"the array 'wavelengths' must grow, and span {SPAN[0]:g} to {SPAN[1]:g} nm")
        weights = reflected_color(wavelengths).astype(np.float32)
        colors = np.einsum("ptwij,wc->ptijc", array, weights, optimize=True)
    if np.abs(colors).max() > MOST_VALUE:
        raise ParseError(f"a value is {np.abs(colors).max():.3g}; at most {MOST_VALUE:g} are allowed")
    return np.ascontiguousarray(np.maximum(colors, 0), np.float32)


def _albedo(data: MeasuredData) -> Doubles:
    """How much is reflected from each of the viewer's angles, (theta, 3); the most over those about the normal."""
    assert data.visible is not None and data.facets is not None and data.areas is not None
    u, v = (each.ravel() for each in np.meshgrid(*2 * [(np.arange(PLACES) + 0.5) / PLACES]))
    out = np.zeros((len(data.phi), len(data.theta), 3))
    round_ = len(data.phi) <= 2
    for i, phi in enumerate(data.phi):
        for k, theta in enumerate(data.theta):
            x, y, density = Warp.of(data.visible[i, k]).draw(u, v)
            wo = from_angles(np.array(theta, np.float64), np.array(phi, np.float64))
            normals = from_angles(theta_of(x), phi_of(y) + (phi if round_ else 0.0))
            wi, cosine = mirrored(wo, normals)
            value = bilinear(data.values[i, k], u, v)
            if data.is_relative:
                at = np.array([np.sqrt(2 * theta / np.pi)]), np.array([phi / (2 * np.pi) + 0.5])
                area = float(bilinear(data.areas, *at)[0])
                value = value * (bilinear(data.facets, x, y) / max(4 * area, 1e-12))[:, None]
            steradians = np.maximum(4 * cosine * area_of(x), 0) / np.maximum(density, 1e-12)
            out[i, k] = (value * (steradians * (wi[:, 2] > 0))[:, None]).mean(axis=0)
    worst: Doubles = out.max(axis=0)
    return worst
