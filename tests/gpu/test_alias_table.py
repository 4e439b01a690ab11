"""Tables to draw from: exact about themselves, close to what was asked, and never drawing what has no weight."""

import subprocess
import sys

import numpy as np
import pytest

from gpu.tables import alias_table

RNG = np.random.default_rng(11)

WEIGHTS = {
    "one": np.array([3.0]),
    "equal": np.full(7, 0.1),
    "thirds": np.full(3, 1 / 3),
    "one heavy": np.array([1e-12, 1.0, 0.0, 1e-12]),
    "heavy at the ends": np.array([5.0, 0.0, 0.0, 1.0, 0.0, 7.0]),
    "zeros": np.where(RNG.random(500) < 0.5, 0.0, RNG.random(500)),
    "steep": RNG.random(5000) ** 20,
    "tiny": np.array([5e-324, 1e-323, 0.0]),
    "large": np.array([1e300, 3e299, 1e298]),
}


def drawn(threshold, alias):
    """Probabilities of a table by the loop that a shader stands for."""
    n = len(threshold)
    probability = np.zeros(n)
    for i in range(n):
        probability[i] += float(threshold[i]) / n
        probability[alias[i]] += (1.0 - float(threshold[i])) / n
    return probability


@pytest.mark.parametrize("name", WEIGHTS)
def test_table_draws_what_it_says_and_what_was_asked(name):
    weights = WEIGHTS[name]
    threshold, alias, probability = alias_table.alias_table(weights)
    assert threshold.dtype == np.float32 and alias.dtype == np.uint32
    assert np.all((threshold >= 0) & (threshold <= 1)) and alias.max() < len(weights)
    np.testing.assert_allclose(probability, drawn(threshold, alias), rtol=1e-12, atol=1e-15)
    assert probability.sum() == pytest.approx(1.0, abs=1e-12)
    asked = weights / weights.max()
    asked /= asked.sum()
    np.testing.assert_allclose(probability, asked, rtol=1e-6, atol=3e-7 / len(weights))
    assert np.all(probability[weights == 0] == 0)


def interpolate(texels, u, v):
    """The bilinear lookup of the contract: texel centres at (i + .5) / n, repeating in u, clamping in v."""
    height, width = texels.shape[:2]
    x, y = u * width - 0.5, np.clip(v * height - 0.5, 0, height - 1)
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - column)[:, None], (y - row)[:, None]
    lower = np.minimum(row + 1, height - 1)
    above = texels[row, column % width] * (1 - fx) + texels[row, (column + 1) % width] * fx
    below = texels[lower, column % width] * (1 - fx) + texels[lower, (column + 1) % width] * fx
    return above * (1 - fy) + below * fy


def test_footprint_is_the_integral_of_the_interpolation():
    texels = RNG.random((4, 5, 1))
    fine = 64
    v, u = np.meshgrid(
        (np.arange(4 * fine) + 0.5) / (4 * fine), (np.arange(5 * fine) + 0.5) / (5 * fine), indexing="ij"
    )
    values = interpolate(texels, u.ravel(), v.ravel()).reshape(4, fine, 5, fine)
    np.testing.assert_allclose(alias_table._footprint(texels[..., 0]), values.mean(axis=(1, 3)), rtol=1e-3)


def test_solid_angles_fill_the_sphere():
    for height, width in ((1, 1), (2, 3), (512, 1024)):
        assert alias_table.solid_angles(height, width).sum() * width == pytest.approx(4 * np.pi)
    edges = np.linspace(0, np.pi, 65)
    expected = 2 * np.pi / 128 * (np.cos(edges[:-1]) - np.cos(edges[1:]))
    np.testing.assert_allclose(alias_table.solid_angles(64, 128), expected, rtol=1e-12)


def drawn_texels(cells, height, width):
    """The chance of each texel, by the shader's rule: a cell, then uniformly in its block's width and band."""
    chance = np.zeros((height, width))
    solid = alias_table.solid_angles(height, width)
    for corner, size, first, count in cells.tolist():
        x, y, w, h = corner & 0xFFFF, corner >> 16, size & 0xFFFF, size >> 16
        band = solid[y : y + h] / solid[y : y + h].sum()
        chance[y : y + h, x : x + w] += band[:, None] / w / len(cells)
        assert count > 0 and first + count <= len(cells)
    return chance


@pytest.mark.parametrize("power", [0, 6, 40])
@pytest.mark.parametrize("size", [(16, 32), (5, 7), (1, 9), (33, 20)])
def test_environment_probability_is_a_density_over_directions(size, power):
    texels = (RNG.random((*size, 3)) ** power).astype(np.float32)
    probability, cells = alias_table.environment_tables(texels)
    solid = alias_table.solid_angles(*size)[:, None]
    assert (probability * solid).sum() == pytest.approx(1.0, abs=1e-6)
    np.testing.assert_allclose(probability * solid, drawn_texels(cells, *size), rtol=1e-5)
    # Blocks hold their cells side by side, in the order in which they are drawn.
    starts = np.flatnonzero(np.diff(cells["first"], prepend=-1))
    assert np.array_equal(cells["first"][starts], starts)
    assert np.array_equal(np.diff(starts, append=len(cells)), cells["count"][starts])


def test_an_estimate_of_the_irradiance_has_little_variance_left():
    texels = (RNG.random((64, 128, 3)) ** 6).astype(np.float32)
    probability, _ = alias_table.environment_tables(texels)
    solid = alias_table.solid_angles(64, 128)[:, None]
    luminance = alias_table._footprint((texels @ alias_table.LUMINANCE).astype(np.float64))
    irradiance = (luminance * solid).sum()
    second = (luminance**2 / probability * solid).sum()
    assert second / irradiance**2 - 1 < 0.15  # sampled uniformly: 1.1
    assert (luminance / probability).max() < 8 * irradiance


def test_near_numbers_draw_near_places():
    x, y = np.meshgrid(np.linspace(-1, 1, 128), np.linspace(-1, 1, 64))
    glow = np.exp(-8 * ((x - 0.3) ** 2 + (y + 0.2) ** 2)).astype(np.float32)[..., None].repeat(3, axis=2)
    _, cells = alias_table.environment_tables(glow)
    at = np.stack([cells["corner"] & 0xFFFF, cells["corner"] >> 16], axis=1).astype(float)
    sixteenths = np.array_split(at, 16)
    within = np.mean([part.var(axis=0).sum() for part in sixteenths])
    assert within < 0.25 * at.var(axis=0).sum()  # shuffled: 1 times


@pytest.mark.parametrize("channel", range(3))
def test_every_lit_texel_can_be_drawn_and_so_can_its_neighbours(channel):
    texels = np.zeros((6, 8, 3), np.float32)
    texels[2, 0, channel] = 1e-3
    probability, cells = alias_table.environment_tables(texels)
    lit = np.zeros((6, 8), bool)
    lit[1:4][:, [7, 0, 1]] = True  # bilinear interpolation reaches across the seam
    assert (probability[lit] > 0).all()
    assert probability[~lit].sum() < 0.05 * probability.sum()
    np.testing.assert_allclose(drawn_texels(cells, 6, 8) > 0, probability > 0)


def test_a_lone_star_is_not_drowned_in_the_dark_around_it():
    texels = np.full((64, 128, 3), 1e-6, np.float32)
    texels[20, 30] = 1e-2
    probability, _ = alias_table.environment_tables(texels)
    assert probability[20, 30] > 100 * probability[20, 60]


def test_constant_and_black_environments_are_uniform():
    for texels in (np.ones((1, 1, 3)), np.zeros((4, 8, 3))):
        probability, _ = alias_table.environment_tables(texels.astype(np.float32))
        np.testing.assert_allclose(probability, alias_table.UNIFORM_SPHERE, rtol=0.01)  # in whole cells


def test_needs_neither_numba_nor_gl():
    code = "import sys, gpu.tables.alias_table; print({'numba', 'moderngl', 'scipy', 'pydantic'} & set(sys.modules))"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "set()"
