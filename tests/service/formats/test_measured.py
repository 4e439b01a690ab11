"""Files of measured reflection: what they say, what is refused, and what is said of odd ones."""

from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np
import pytest

from service.colorimetry import reflected_color
from service.formats import AssetLimits
from service.formats.errors import ParseError
from service.formats.formats import sniff
from service.formats.read.measured import merl
from service.formats.read.measured.adaptive import parse_adaptive
from service.formats.read.measured.tensor_file import parse_tensor_file
from service.formats.read.measured.warp import Warp
from service.problems import AssetError
from service.server.assets import AssetStore
from tests import measured_files
from tests.measured_files import Facets, tensor_file

LIMITS = AssetLimits()
Arrays = dict[str, np.ndarray]


def constant(value: float) -> measured_files.Reflection:
    return lambda wo, wi: np.broadcast_to(np.float64(value), (*wo.shape[:-1], 3))


@pytest.fixture(scope="module")
def plastic() -> bytes:
    return measured_files.merl(Facets())


@pytest.fixture(scope="module")
def rough() -> Arrays:
    return measured_files.adaptive(Facets(alpha=(0.5, 0.5)), thetas=4, side=8, fine=16)


def test_merl_between_the_middles_of_cells(plastic: bytes) -> None:
    data = merl.parse_merl(plastic)
    rng = np.random.default_rng(1)
    wo, wi = (_hemisphere(rng, 5000) for _ in range(2))
    found, expected = merl.lookup(data.values, wo, wi), Facets()(wo, wi)
    np.testing.assert_allclose(np.quantile(np.abs(found / expected - 1), (0.5, 0.99)), 0, atol=0.01)
    assert data.warnings == () and len(data.limits) == 0


def test_the_albedo_of_light_from_all_sides() -> None:
    assert merl.parse_merl(measured_files.merl(constant(0.4 / np.pi))).albedo == pytest.approx((0.4,) * 3, abs=1e-3)


def test_what_was_not_measured_is_taken_from_beside_it(plastic: bytes) -> None:
    """Negative entries in front of the surface, and none that lie below the horizon, whatever these say."""
    whole = merl.parse_merl(plastic)
    zeros = merl.parse_merl(measured_files.merl(Facets(), unknown=0.0))
    assert np.array_equal(whole.values, zeros.values)
    table = np.frombuffer(plastic, "<f8", offset=12).reshape(3, 90, 90, 180).copy()
    table[1, 20:40, 30:60] = -1
    holed = merl.parse_merl(plastic[:12] + table.tobytes())
    assert np.array_equal(holed.values[20:40, 45], whole.values[20:40, 29])
    assert np.array_equal(holed.values[:20], whole.values[:20])
    (said,) = holed.warnings
    assert "was not measured" in said


def test_more_light_than_arrives_is_scaled_down_and_told() -> None:
    """Twice the light comes back at any angle: each of two directions takes a factor of a half."""
    data = merl.parse_merl(measured_files.merl(constant(2 / np.pi)))
    np.testing.assert_allclose(data.limits, 0.5, rtol=2e-3)
    (said,) = data.warnings
    assert said.startswith("it reflects more light than arrives from 0 degrees on, up to 2.00 times as much")


def _with(place: int, value: float) -> Callable[[bytes], bytes]:
    return lambda file: file[: 12 + 8 * place] + struct.pack("<d", value) + file[20 + 8 * place :]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda file: file[:8], "8 bytes; a MERL file begins with three whole numbers"),
        (lambda file: file[:1000], "it ends after 1000 bytes; a MERL file has 34992012"),
        (lambda file: file + b"\0", "it has 34992013 bytes"),
        (lambda file: struct.pack("<3i", 90, 90, 360) + file[12:], "has 90 x 90 x 360 entries"),
        (lambda file: struct.pack("<3i", -1, 0, 2**31 - 1) + file[12:], "has -1 x 0 x 2147483647 entries"),
        (_with(77, float("nan")), "infinite or not a number"),
        (_with(77, float("-inf")), "infinite or not a number"),
        (_with(77, 1e300), "at most 1e+06 are allowed"),
        (lambda file: file[:12] + np.full(4374000, -1.0).tobytes(), "no entry is known"),
    ],
)
def test_merl_files_that_are_refused(plastic: bytes, change: Callable[[bytes], bytes], said: str) -> None:
    with pytest.raises(ParseError) as refused:
        merl.parse_merl(change(plastic))
    assert said in refused.value.detail


def test_the_kind_of_a_file(plastic: bytes, rough: Arrays) -> None:
    assert sniff(plastic[:100]) == sniff(b"\0" * 12, filename="gold.binary") == "binary"
    assert sniff(tensor_file(rough)) == sniff(b"", filename="a.BSDF") == "bsdf"


def test_tensor_files_hold_arrays(rough: Arrays) -> None:
    found = parse_tensor_file(tensor_file(rough))
    assert found.keys() == rough.keys()
    assert all(np.array_equal(found[name], array) for name, array in rough.items())


def test_spectra_become_the_colour_of_daylight(rough: Arrays) -> None:
    """A grey spectrum keeps its value; one that ends at 600 nm is orange's complement."""
    wavelengths = np.arange(360.0, 831.0, 5.0)
    spectral = measured_files.adaptive(Facets(alpha=(0.5, 0.5)), thetas=4, side=8, fine=16, wavelengths=wavelengths)
    grey = parse_adaptive(tensor_file(spectral), LIMITS)
    red = parse_adaptive(tensor_file(rough), LIMITS).values[..., 0]
    np.testing.assert_allclose(grey.values, red[..., None].repeat(3, axis=-1), rtol=1e-5, atol=1e-6)
    weights = reflected_color(wavelengths)
    cut = weights[wavelengths < 600].sum(axis=0)
    assert cut[0] < 0.25 and cut[1] > 0.9 and cut[2] > 0.9
    spectral["spectra"] = spectral["spectra"] * (wavelengths < 600)[:, None, None].astype("<f4")
    blue = parse_adaptive(tensor_file(spectral), LIMITS)
    np.testing.assert_allclose(blue.values, np.maximum(red[..., None] * cut, 0), rtol=1e-5, atol=1e-6)


def test_symmetric_measurements_cover_a_part_of_the_circle() -> None:
    facets = Facets(alpha=(0.3, 0.6))
    for parts in (1, 2, 4):
        phis = np.linspace(-np.pi, -np.pi + 2 * np.pi / parts, 5)
        data = parse_adaptive(tensor_file(measured_files.adaptive(facets, phis, 3, 6, 12)), LIMITS)
        assert data.symmetry == parts
    arrays = measured_files.adaptive(facets, np.linspace(-np.pi, -np.pi / 3, 5), 3, 6, 12)
    with pytest.raises(ParseError, match="'phi_i' covers 120 degrees"):
        parse_adaptive(tensor_file(arrays), LIMITS)


def _without(name: str) -> Callable[[Arrays], Arrays]:
    return lambda arrays: {each: array for each, array in arrays.items() if each != name}


def _changed(name: str, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Arrays], Arrays]:
    return lambda arrays: {**arrays, name: change(arrays[name].copy())}


def _put(value: float) -> Callable[[np.ndarray], np.ndarray]:
    def put(array: np.ndarray) -> np.ndarray:
        array.flat[1] = value
        return array

    return put


@pytest.mark.parametrize(
    ("change", "said"),
    [
        *((_without(name), f"the array {name!r} is missing") for name in ("ndf", "sigma", "vndf", "luminance")),
        (_without("rgb"), "the array 'spectra' is missing"),
        (_changed("ndf", _put(np.nan)), "the array 'ndf' has a number that is infinite or none"),
        (_changed("vndf", _put(-1.0)), "the array 'vndf' has a negative number"),
        (_changed("vndf", lambda a: a[:, :3]), "the array 'vndf' must be by 1 x 4 directions"),
        (_changed("vndf", lambda a: a.astype("<f8")), "must be of 32-bit floats along 4 axes"),
        (_changed("theta_i", lambda a: a[::-1].copy()), "the array 'theta_i' must be angles that grow"),
        (_changed("theta_i", lambda a: a[:0]), "the array 'theta_i' must be angles that grow"),
        (_changed("rgb", lambda a: a[:, :, :2].copy()), "has 2 channels; it must have 3"),
        (_changed("rgb", lambda a: a[..., :5].copy()), "its colours are by"),
        (_changed("rgb", _put(1e30)), "at most 1e+06 are allowed"),
        (_changed("sigma", lambda a: a[:1]), "the array 'sigma' must have 2 to 1024 entries a side"),
    ],
)
def test_rgl_files_that_are_refused(rough: Arrays, change: Callable[[Arrays], Arrays], said: str) -> None:
    with pytest.raises(ParseError) as refused:
        parse_adaptive(tensor_file(change(rough)), LIMITS)
    assert said in refused.value.detail


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda file: file[:10], "ends after 10 bytes"),
        (lambda file: file[:30], "ends after 30 bytes, within the list of its arrays"),
        (lambda file: file[:-1], "within array 'rgb'"),
        (lambda file: file[:12] + b"\2\0" + file[14:], "its version is 2.0"),
        (lambda file: file[:14] + b"\xff\xff\xff\xff" + file[18:], "says that it has 4294967295 arrays"),
    ],
)
def test_broken_tensor_files(rough: Arrays, change: Callable[[bytes], bytes], said: str) -> None:
    with pytest.raises(ParseError) as refused:
        parse_tensor_file(change(tensor_file(rough)))
    assert said in refused.value.detail


def test_arrays_that_claim_to_be_huge() -> None:
    """Their product overflows 64 bits; nothing is allocated."""
    head = b"tensor_file\0" + struct.pack("<BBIH", 1, 0, 1, 3) + b"ndf" + struct.pack("<HBQ", 3, 10, 0)
    with pytest.raises(ParseError, match="within array 'ndf'"):
        parse_tensor_file(head + struct.pack("<3Q", 2**63, 2**63, 2**63) + bytes(100))


def test_densities_are_drawn_from_as_they_are() -> None:
    """Numbers that are even over the square land in each cell as often as the density says."""
    rng = np.random.default_rng(2)
    warp = Warp.of(rng.random((7, 9)) ** 4)
    x, y, density = warp.draw(*(rng.random((2, 200_000))))
    seen = np.histogram2d(y, x, (6, 8), ((0, 1), (0, 1)))[0] / len(x)
    nodes = warp.density
    expected = (nodes[1:, 1:] + nodes[1:, :-1] + nodes[:-1, 1:] + nodes[:-1, :-1]) / 4 / 48
    np.testing.assert_allclose(seen, expected, atol=5 * np.sqrt(expected.max() / len(x)))
    np.testing.assert_allclose((1 / density).mean(), 1, rtol=0.02)  # over the whole square


def test_uploads_are_measurements(store: AssetStore, plastic: bytes, rough: Arrays) -> None:
    info = store.add(plastic)
    assert (info.kind, info.format, info.warnings) == ("measured", "binary", None)
    assert store.measured(info.id).values.shape == (90, 90, 180, 3)
    bsdf = store.add(tensor_file(rough), filename="rough.bsdf")
    assert (bsdf.kind, bsdf.format) == ("measured", "bsdf")
    data = store.measured(bsdf.id)
    assert data.visible is not None and np.array_equal(data.visible, rough["vndf"])
    with pytest.raises(AssetError, match="is measured reflection; an image is needed here"):
        store.image(info.id)
    with pytest.raises(AssetError, match="the BINARY file: it ends after 100 bytes"):
        store.add(plastic[:100])
    bright = store.add(measured_files.merl(constant(2 / np.pi)))
    assert bright.warnings and "more light than arrives" in bright.warnings[0]["detail"]


def _hemisphere(rng: np.random.Generator, n: int) -> np.ndarray:
    z, phi = rng.uniform(0.1, 1, n), rng.uniform(0, 2 * np.pi, n)
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], 1)
