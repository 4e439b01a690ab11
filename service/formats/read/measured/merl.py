"""The files of the MERL database: reflection of isotropic surfaces over half and difference angles [Matusik et al.
2003, "A data-driven reflectance model"].

Three whole numbers, 90, 90 and 180, are followed by a table of doubles for each of red, green and blue: by the half
vector's angle to the normal, in steps that grow along the way, by the angle between a direction and the half vector,
and by the angle about it. An entry is the mean of its cell. Negative ones mark what was not measured.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from service.formats.errors import ParseError
from service.formats.read.measured import energy
from service.formats.read.measured.directions import (
    area_of,
    from_angles,
    half_and_difference,
    mirrored,
    phi_of,
    theta_of,
)
from service.formats.types import Doubles, Floats, MeasuredData

SHAPE = (90, 90, 180)
HEAD = np.array(SHAPE, "<i4").tobytes()
BYTES = len(HEAD) + 3 * 8 * SHAPE[0] * SHAPE[1] * SHAPE[2]
SCALES = (1.00 / 1500, 1.15 / 1500, 1.66 / 1500)  # from the numbers of the database to 1/sr
MOST_VALUE = 1e6  # 1/sr; polished metals come to some thousands
COUNTED = 0.01  # the share of entries above the horizon that may be missing without a word

# The grid of the sampler: angles of the viewer, and places on the unit square of the facets' normals.
VIEWS, ROWS, COLUMNS = 24, 65, 90
# Sums over directions: angles of the viewer, and places on that square.
ALBEDO_VIEWS, ALBEDO_ROWS, ALBEDO_COLUMNS = 46, 48, 120
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def parse_merl(data: bytes | memoryview) -> MeasuredData:
    """Raises ParseError."""
    if len(data) < len(HEAD):
        raise ParseError(f"{len(data)} bytes; a MERL file begins with three whole numbers, 90, 90 and 180")
    shape = tuple(np.frombuffer(data, "<i4", 3).tolist())
    if shape != SHAPE:
        raise ParseError(
            f"its table has {' x '.join(map(str, shape))} entries; those of the MERL database 90 x 90 x 180"
        )
    if len(data) != BYTES:
        kind = "ends after" if len(data) < BYTES else "has"
        raise ParseError(f"it {kind} {len(data)} bytes; a MERL file has {BYTES}")
    table = np.frombuffer(data, "<f8", offset=len(HEAD)).reshape(3, *SHAPE)
    if not np.isfinite(table).all():
        raise ParseError("an entry is infinite or not a number")
    values = np.moveaxis(table, 0, -1) * SCALES
    if values.max() > MOST_VALUE:
        raise ParseError(f"an entry is {values.max():.3g} / sr; at most {MOST_VALUE:g} are allowed")
    above = _above_horizon()
    known = above & (values >= 0).all(axis=-1)
    if not known.any():
        raise ParseError("no entry is known: those that are negative were not measured")
    missing = 1 - known.sum() / above.sum()
    values = _filled(values, known)
    theta, albedo = _albedo(values)
    limits = energy.limits(theta, albedo)
    warnings = [f"{missing:.1%} of what a camera sees was not measured: the nearest entries stand in for it"]
    views = np.linspace(0, np.pi / 2, VIEWS)
    return MeasuredData(
        values.astype(np.float32),
        views.astype(np.float32),
        np.zeros(1, np.float32),
        _density(values, views),
        limits,
        energy.mean_albedo(theta, albedo),
        warnings=(*(warnings if missing > COUNTED else ()), *energy.warnings(theta, albedo)),
    )


def lookup(values: np.ndarray, wo: Doubles, wi: Doubles) -> Doubles:
    """Reflection (n, 3) for pairs of directions (n, 3), between the middles of cells. The shader does the same."""
    theta_h, theta_d, phi_d = half_and_difference(wo, wi)
    places = (
        90 * np.sqrt(theta_h / (0.5 * np.pi)) - 0.5,
        90 * theta_d / (0.5 * np.pi) - 0.5,
        180 * phi_d / np.pi - 0.5,
    )
    flat = values.reshape(-1, 3)
    (h, h_next, s), (d, d_next, t) = (_between(np.clip(place, 0, 89)) for place in places[:2])
    p = np.floor(places[2]).astype(int)
    u = (places[2] - p)[:, None]
    p, p_next = p % 180, (p + 1) % 180
    out = np.zeros((len(wo), 3))
    for half, weight_h in ((h, 1 - s), (h_next, s)):
        for difference, weight_d in ((d, 1 - t), (d_next, t)):
            line = (half * 90 + difference) * 180
            out += (weight_h * weight_d)[:, None] * (flat[line + p] * (1 - u) + flat[line + p_next] * u)
    return out


def _between(place: Doubles) -> tuple[np.ndarray, np.ndarray, Doubles]:
    first = np.minimum(place.astype(int), 88)
    return first, first + 1, place - first


def _above_horizon() -> np.ndarray:
    """True for cells that have, by their middles, both directions in front of the surface."""
    h, d, p = np.ix_(*(np.arange(n) + 0.5 for n in SHAPE))
    theta_h, theta_d, phi_d = 0.5 * np.pi * (h / 90) ** 2, 0.5 * np.pi * d / 90, np.pi * p / 180
    upright, tilt = np.cos(theta_h) * np.cos(theta_d), np.sin(theta_h) * np.sin(theta_d) * np.cos(phi_d)
    found: np.ndarray = np.abs(tilt) < upright
    return found


def _filled(values: np.ndarray, known: np.ndarray) -> np.ndarray:
    """With the entries that are not known taken from the nearest one along the difference angle, and where none is
    known there, along the half angle: first from the smaller angle."""
    for axis in (1, 0):
        for way in (1, -1):
            flipped, seen = (np.flip(each, axis) if way < 0 else each for each in (values, known))
            at = np.where(seen, np.arange(SHAPE[axis]).reshape([-1 if k == axis else 1 for k in range(3)]), -1)
            at = np.maximum.accumulate(at, axis=axis)
            filled = np.take_along_axis(flipped, np.maximum(at, 0)[..., None], axis=axis)
            filled = np.where((at >= 0)[..., None], filled, flipped)
            values, known = (np.flip(each, axis) if way < 0 else each for each in (filled, at >= 0))
    return np.where(known[..., None], values, 0.0)


def _reflected(values: Doubles, views: Doubles, x: Doubles, y: Doubles) -> Iterator[Doubles]:
    """For each angle of the viewer: reflection times cosine and the steradians of each place's direction over its
    area, (n, 3), for places (n,) on the unit square of facets' normals."""
    normals, area = from_angles(theta_of(x), phi_of(y)), area_of(x)
    for view in views:
        wo = np.broadcast_to(np.array([np.sin(view), 0.0, np.cos(view)]), normals.shape)
        wi, cosine = mirrored(wo, normals)
        seen = (wi[:, 2] > 0) & (cosine > 0)
        out = np.zeros((len(x), 3))
        weight = (wi[:, 2] * 4 * cosine * area)[seen]
        out[seen] = lookup(values, wo[seen], wi[seen]) * weight[:, None]
        yield out


def _albedo(values: Doubles) -> tuple[Doubles, Doubles]:
    """Angles of the viewer, and how much is reflected from there, (ALBEDO_VIEWS, 3)."""
    x, y = np.meshgrid(*((np.arange(n) + 0.5) / n for n in (ALBEDO_COLUMNS, ALBEDO_ROWS)))
    views = np.linspace(0, np.pi / 2, ALBEDO_VIEWS)
    reflected = _reflected(values, views, x.ravel(), y.ravel())
    return views, np.array([each.mean(axis=0) for each in reflected])


def _density(values: Doubles, views: Doubles) -> Floats:
    """How likely facets of each normal shall be drawn, for each angle of the viewer: (1, VIEWS, ROWS, COLUMNS). That
    of the two directions about the plane of incidence is the same."""
    x, y = np.meshgrid(np.linspace(0, 1, COLUMNS), np.linspace(0, 1, ROWS))
    found = [each @ _LUMINANCE for each in _reflected(values, views, x.ravel(), y.ravel())]
    density = np.array(found).reshape(1, len(views), ROWS, COLUMNS)
    out: Floats = (0.5 * (density + density[:, :, ::-1])).astype(np.float32)
    return out
