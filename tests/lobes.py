"""Materials that show one lobe or several, and cells over half vectors to count a lobe's samples in."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gpu.layout.models import NUMBERS
from tests import stats
from tests.probing import materials, openpbr

D, METAL_ROUGH, BLINN_PHONG = NUMBERS["disney"], NUMBERS["metal_rough"], NUMBERS["blinn_phong"]
PHONG = NUMBERS["phong"]
ROWS = {
    "diffuse": materials(model=NUMBERS["diffuse"], base_color=(0.8, 0.5, 0.1)),
    "disney default": materials(model=D),
    "retro-reflective": materials(model=D, roughness=1, specular=0, base_color=(0.9, 0.2, 0.4)),
    "subsurface": materials(model=D, subsurface=1, roughness=0.8),
    "sheen": materials(model=D, sheen=1, sheen_tint=1, base_color=(0.1, 0.1, 0.6)),
    "rough metal": materials(model=D, metallic=1, roughness=0.7, base_color=(1, 0.78, 0.34)),
    "smooth metal": materials(model=D, metallic=1, roughness=0.1),
    "mirror": materials(model=D, metallic=1, roughness=0, base_color=0.9),
    "brushed": materials(model=D, metallic=1, roughness=0.4, anisotropic=0.9),
    "tinted": materials(model=D, specular=1, specular_tint=1, base_color=(0.1, 0.7, 0.2), roughness=0.3),
    "clear coat": materials(model=D, clearcoat=1, clearcoat_gloss=1, base_color=(0.4, 0, 0)),
    "hazy coat": materials(model=D, clearcoat=1, clearcoat_gloss=0, metallic=0.5, roughness=0.9),
    "everything": materials(
        model=D, base_color=(0.6, 0.3, 0.2), metallic=0.3, subsurface=0.4, specular=0.8, roughness=0.35,
        specular_tint=0.5, anisotropic=0.6, sheen=0.7, sheen_tint=0.3, clearcoat=0.8, clearcoat_gloss=0.7,
    ),
    "glTF metal": materials(model=METAL_ROUGH, metallic=1, roughness=0.5, base_color=(1, 0.78, 0.34)),
    "glTF mirror": materials(model=METAL_ROUGH, metallic=1, roughness=0, base_color=0.9),
    "glTF dielectric": materials(model=METAL_ROUGH, roughness=0.2, base_color=(0.1, 0.5, 0.9)),
    "glTF rough": materials(model=METAL_ROUGH, roughness=1, base_color=0.8, metallic=0.4),
    "blinn-phong": materials(model=BLINN_PHONG, base_color=(0.4, 0.1, 0.1), phong_specular=0.5, shininess=40),
    "blinn-phong flat": materials(model=BLINN_PHONG, base_color=0, phong_specular=(1, 0.5, 0.2), shininess=0),
    "blinn-phong dull": materials(model=BLINN_PHONG, base_color=0.2, phong_specular=1, shininess=2.5),
    "blinn-phong mirror": materials(model=BLINN_PHONG, base_color=0, phong_specular=1, shininess=1e6),
    "phong": materials(model=PHONG, base_color=(0.4, 0.1, 0.1), phong_specular=0.5, shininess=40),
    "phong flat": materials(model=PHONG, base_color=0.3, phong_specular=(1, 0.5, 0.2), shininess=0),
    "phong dull": materials(model=PHONG, base_color=0.2, phong_specular=1, shininess=2.5),
    "phong mirror": materials(model=PHONG, base_color=0, phong_specular=1, shininess=1e6),
}  # fmt: skip
P = NUMBERS["principled"]
GLASS = {"model": P, "transmission": 1, "base_color": (1, 0.8, 0.6)}
PRINCIPLED = {
    "plastic": materials(model=P, roughness=0.3),
    "rough plastic": materials(model=P, roughness=1, specular=1, base_color=(0.9, 0.2, 0.1)),
    "principled metal": materials(model=P, metallic=1, roughness=0.7, base_color=(1, 0.78, 0.34)),
    "principled brushed": materials(model=P, metallic=1, roughness=0.4, anisotropic=0.9, anisotropic_rotation=30),
    "flat": materials(model=P, subsurface=1, roughness=0.6),
    "velvet": materials(model=P, sheen=1, sheen_roughness=0.6, base_color=0.1),
    "satin": materials(model=P, sheen=1, sheen_roughness=0, specular=0, sheen_color=(1, 0.2, 0.4)),
    "principled coat": materials(model=P, clearcoat=1, clearcoat_gloss=0, base_color=(0.4, 0, 0)),
    "rough coat": materials(model=P, clearcoat=0.8, clearcoat_roughness=0.4, metallic=0.5, specular_color=(1, 0, 0)),
    "frosted": materials(roughness=0.3, **GLASS),
    "rough glass": materials(roughness=0.8, ior=1.8, **GLASS),
    "brushed glass": materials(roughness=0.5, anisotropic=0.8, **GLASS),
    "gold": materials(
        model=P, metallic=1, roughness=0.4, conductor_eta=(0.18, 0.42, 1.37), conductor_k=(3.42, 2.35, 1.77),
    ),
    "oxide": materials(
        model=P, metallic=1, roughness=0.5, base_color=(1, 0.78, 0.34), film_thickness=60, film_ior=2.3,
    ),
    "oiled": materials(model=P, roughness=0.5, base_color=(0.1, 0.4, 0.7), film_thickness=350, film_ior=1.9),
    "iridescent glass": materials(roughness=0.7, film_thickness=400, film_ior=1.8, **GLASS),
    "all at once": materials(
        model=P, base_color=(0.6, 0.3, 0.2), metallic=0.3, subsurface=0.4, specular=0.8, roughness=0.45,
        specular_tint=0.5, anisotropic=0.6, sheen=0.7, sheen_tint=0.3, clearcoat=0.8, clearcoat_gloss=0.2,
        transmission=0.6,
    ),
}  # fmt: skip

BRUSHED = {"anisotropic": 0.8, "anisotropic_rotation": 30}
RED_COAT = {"clearcoat": 0.8, "coat_color": (1, 0.3, 0.2), "clearcoat_roughness": 0.4}
OPENPBR = {
    "openpbr default": openpbr(),
    "edge of metal": openpbr(metallic=1, base_color=(1, 0.7, 0.3), specular_color=(0.2, 0.5, 1), **BRUSHED),
    "clay": openpbr(diffuse_roughness=1, base_color=(0.9, 0.5, 0.2), roughness=0.6),
    "bright": openpbr(specular=12, specular_color=(1, 0.5, 0.2), roughness=0.5),
    "openpbr glass": openpbr(transmission=1, attenuation_color=(1, 0.8, 0.6), roughness=0.5, **BRUSHED),
    "bubble": openpbr(transmission=1, ior=0.7, roughness=0.4),
    "red coat": openpbr(**RED_COAT, coat_anisotropy=0.7, coat_rotation=50, roughness=0.5),
    "coated glass": openpbr(**RED_COAT, transmission=0.9, roughness=0.4),
    "fuzz": openpbr(sheen=1, sheen_roughness=0.6, sheen_color=(1, 0.2, 0.4), base_color=0.1),
    "filmed": openpbr(film_thickness=450, film_ior=2, diffuse_roughness=0.7, roughness=0.4, film_weight=0.8),
    "filmed layers": openpbr(**RED_COAT, film_thickness=300, transmission=0.4, metallic=0.3, roughness=0.5),
    "fine fuzz": openpbr(sheen=1, sheen_roughness=0.15, specular=0),
    "layers": openpbr(**RED_COAT, sheen=0.5, transmission=0.3, metallic=0.3, diffuse_roughness=0.5, roughness=0.5),
}
WALL = {"model": P, "thin_walled": 1}
LEAF = {**WALL, "base_color": (0.2, 0.5, 0.1), "diffuse_transmission": 0.5}
WALLS = {
    "frosted pane": materials(**WALL, transmission=1, base_color=(1, 0.8, 0.6), roughness=0.5),
    "rough pane": materials(**WALL, transmission=0.7, roughness=0.9, ior=2.2, specular_color=(1, 0.4, 0.2)),
    "brushed pane": materials(**WALL, transmission=1, roughness=0.5, anisotropic=0.8, anisotropic_rotation=30),
    "leaf": materials(**LEAF, diffuse_transmission_color=(0.4, 0.8, 0.1), roughness=0.4),
    "waxed leaf": materials(**LEAF, clearcoat=1, clearcoat_roughness=0.4, sheen=0.5, subsurface=0.6),
    "oiled paper": materials(**LEAF, transmission=0.5, roughness=0.6, metallic=0.2, clearcoat=0.5, clearcoat_gloss=0),
    "openpbr pane": openpbr(thin_walled=1, transmission=0.9, attenuation_color=(1, 0.8, 0.6), roughness=0.6),
    "bubble's wall": openpbr(thin_walled=1, transmission=1, ior=0.7, roughness=0.5),
    "coated pane": openpbr(thin_walled=1, **RED_COAT, transmission=0.9, roughness=0.4, sheen=0.3),
}
LAYERED = PRINCIPLED | OPENPBR | WALLS


class Grid:
    """Cells over half vectors, in the logarithm of their slope and in azimuth: any lobe is smooth there."""

    SLOPES = np.linspace(math.log(1e-6), math.log(2e3), 81)
    AZIMUTHS = 16
    FINE = 20

    def __init__(self, wo: np.ndarray) -> None:
        self.wo = wo
        n = (len(self.SLOPES) - 1) * self.FINE
        x = self.SLOPES[0] + (np.arange(n) + 0.5) * (self.SLOPES[-1] - self.SLOPES[0]) / n
        phi = (np.arange(self.AZIMUTHS * self.FINE) + 0.5) * 2 * np.pi / (self.AZIMUTHS * self.FINE)
        x, phi = (a.ravel() for a in np.meshgrid(x, phi, indexing="ij"))
        cos = 1 / np.sqrt(1 + np.exp(2 * x))
        sin = cos * np.exp(x)
        wm = np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], 1)
        cos_d = wm @ wo
        self.wi = 2 * cos_d[:, None] * wm - wo
        step = (self.SLOPES[1] - self.SLOPES[0]) / self.FINE * 2 * np.pi / (self.AZIMUTHS * self.FINE)
        # d omega_m = sin dtheta dphi with dtheta = sin cos dx; d omega_i = 4 cos_d d omega_m
        self.solid_angle = np.where((cos_d > 0) & (self.wi[:, 2] > 0), 4 * cos_d * sin * sin * cos * step, 0)

    def sums(self, density: np.ndarray) -> np.ndarray:
        cells = (density * self.solid_angle).reshape(len(self.SLOPES) - 1, self.FINE, self.AZIMUTHS, self.FINE)
        return cells.sum((1, 3))

    def counts(self, wi: np.ndarray) -> np.ndarray:
        wm = wi + self.wo
        wm /= np.linalg.norm(wm, axis=1, keepdims=True)
        x = np.log(np.maximum(np.hypot(wm[:, 0], wm[:, 1]), 1e-12) / wm[:, 2])
        phi = np.arctan2(wm[:, 1], wm[:, 0]) % (2 * np.pi)
        return np.histogram2d(x, phi, [self.SLOPES, np.linspace(0, 2 * np.pi, self.AZIMUTHS + 1)])[0]

    def assert_samples_follow(self, on_grid: np.ndarray, f: np.ndarray, wi: np.ndarray, cases: int) -> None:
        """That samples `wi` (n, 3) with the values `f` (n, 4), rgb and density, follow the density of `on_grid`, by a
        chi-square test among `cases`, and carry the albedo that its values integrate to."""
        n, alive = len(f), f[:, 3] > 0
        observed, expected = self.counts(wi[alive]), self.sums(on_grid[:, 3]) * len(f)
        # Samples below the horizon are lost; quadrature knows their share to about a percent at grazing angles.
        assert observed.sum() == pytest.approx(expected.sum(), abs=0.012 * n)
        p = stats.chi_square(observed, expected * (observed.sum() / expected.sum()))
        assert p > stats.sidak(1e-3, cases), f"chi-square p = {p:.2g}"
        weights = np.where(alive[:, None], f[:, :3] / np.where(alive, f[:, 3], 1)[:, None], 0)
        albedo = np.array([self.sums(on_grid[:, c]).sum() for c in range(3)])
        error = weights.std(0) / math.sqrt(n)
        assert (np.abs(weights.mean(0) - albedo) < 4.5 * error + 2e-3 * albedo + 1e-6).all()
