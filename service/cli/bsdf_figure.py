"""Curves of BSDFs as figures. Raises ImportError without matplotlib, which takes half a second to load."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from service.cli.bsdf_curves import Curves
from service.colorimetry import LUMINANCE

AXES = {  # what is on the two axes
    "distribution": ("angle of the facet's normal (degrees)", "D (1/sr)"),
    "geometry": ("angle of the incident direction (degrees)", "G"),
    "fresnel": ("angle of incidence on the facet (degrees)", "F"),
    "albedo": ("angle to the normal (degrees)", "directional albedo"),
}
COLORS = {"r": "#c0392b", "g": "#27803b", "b": "#2b5fc0"}
LOBES = {
    "diffuse": "#c77700",
    "specular": "#0b7a99",
    "multiscatter": "#7a5195",
    "sheen": "#b0447a",
    "fuzz": "#b0447a",
    "clearcoat": "#4c7a1f",
    "coat": "#4c7a1f",
    "transmission": "#3a55c4",
}
STYLES = ("-", "--")  # line styles of the first and the second material
PEAKED = 20.0  # peak over median above which a lobe's radius is logarithmic: else only the peak would be visible


def draw(materials: Mapping[str, Curves], format: str) -> bytes:
    """The figure as "svg" or "png". The same curves give the same bytes."""
    kind = next(iter(materials.values())).kind
    wide = 6.4 * (len(materials) if kind == "slice" else 1)
    sheet = Figure(figsize=(wide, 4.6 if kind == "polar" and _opaque(materials) else 5.2), layout="constrained")
    FigureCanvasAgg(sheet)
    if kind == "slice":
        _slices(sheet, materials)
    elif kind == "polar":
        _polar(sheet.add_subplot(projection="polar"), materials)
    else:
        _plain(sheet.add_subplot(), kind, materials)
    out = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "sunbox", "svg.fonttype": "none"}):
        sheet.savefig(out, format=format, dpi=150, metadata={"Date": None} if format == "svg" else None)
    return out.getvalue()


def _curves(materials: Mapping[str, Curves]) -> list[tuple[Curves, np.ndarray, dict[str, Any]]]:
    """For each curve: its material's curves, its values, and options of the plot."""
    out = []
    for (name, curves), style in zip(materials.items(), STYLES, strict=False):
        groups = list(dict.fromkeys(column.rpartition("_")[0] for column in curves.columns))  # one for each angle
        for column, values in curves.columns.items():
            label = f"{name}: {column}" if len(materials) > 1 else column
            group, _, channel = column.rpartition("_")
            shade = 1 - 0.65 * groups.index(group) / len(groups)
            look = {"label": label, "linestyle": style, "color": COLORS.get(channel), "alpha": shade}
            out.append((curves, values, look))
        angles = list(dict.fromkeys(column.rpartition("_")[0] for column in curves.lobes))
        for column, parts in curves.lobes.items():
            angle, _, lobe = column.rpartition("_")
            label = f"{name}: {column}" if len(materials) > 1 else column
            shade = 1 - 0.65 * angles.index(angle) / len(angles)
            look = {"label": label, "linestyle": style, "color": LOBES[lobe], "alpha": shade, "linewidth": 1}
            out.append((curves, parts @ LUMINANCE, look))
    return out


def _opaque(materials: Mapping[str, Curves]) -> bool:
    """True if all polar diagrams lack a lower half."""
    return all(abs(curves.theta).max() <= 90 for curves in materials.values())


def _plain(plot: Any, kind: str, materials: Mapping[str, Curves]) -> None:
    for curves, values, how in _curves(materials):
        plot.plot(curves.theta, values, **how)
    across, up = AXES[kind]
    plot.set_xlabel(across)
    plot.set_ylabel(up)
    plot.set_xlim(0, 90)
    if kind == "distribution":
        plot.set_yscale("log")
    else:
        plot.set_ylim(bottom=0)
    plot.grid(True, alpha=0.3)
    plot.legend()


def _polar(plot: Any, materials: Mapping[str, Curves]) -> None:
    plot.set_theta_zero_location("N")
    plot.set_theta_direction(-1)
    if _opaque(materials):
        plot.set_thetamin(-90)
        plot.set_thetamax(90)
    drawn = _curves(materials)
    for curves, values, how in drawn:
        plot.plot(np.radians(curves.theta), values, **how)
    lit = np.concatenate([values[values > 0] for _, values, _ in drawn])
    if len(lit) and lit.max() > PEAKED * np.median(lit):
        least = float(np.median(lit))
        plot.set_rscale("symlog", linthresh=least)
        plot.set_rticks(10.0 ** np.arange(np.ceil(np.log10(2 * least)), np.log10(lit.max())))
    top = float(lit.max()) if len(lit) else 1.0
    plot.set_rlim(0, 1.05 * top)
    for curves in materials.values():
        for lobe in (lobe for lobes in curves.specular.values() for lobe in lobes):
            angle = np.radians(lobe.theta)
            plot.plot([angle, angle], [0, top], color="black", linewidth=1)
            plot.annotate(f"{max(lobe.weight):.3g}", (angle, top), fontsize=8)
    plot.set_xlabel("f (1/sr) in the plane of incidence; lines: perfectly specular lobes and their weights")
    plot.figure.legend(loc="outside upper center", ncols=3 * len(materials), frameon=False)


def _slices(sheet: Any, materials: Mapping[str, Curves]) -> None:
    for i, (name, curves) in enumerate(materials.items()):
        plot = sheet.add_subplot(1, len(materials), i + 1)
        assert curves.image is not None
        # White is f = 1 / pi, the greatest value of a matte surface; the curve is nearly sRGB's.
        shown = np.clip(curves.image * np.pi, 0, 1) ** (1 / 2.2)
        plot.imshow(shown, origin="lower", extent=(0, 90, 0, 90), interpolation="nearest")
        plot.set_title(name)
        plot.set_xlabel("theta_h (degrees)")
        plot.set_ylabel("theta_d (degrees)")
