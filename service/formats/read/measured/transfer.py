"""Measured reflection on its way from the process that read it, whose word about its form is not taken."""

from __future__ import annotations

from typing import Any

import numpy as np

from service.formats.types import MeasuredData

FACTS = ("albedo", "symmetry", "is_relative", "warnings")


def sent(data: MeasuredData) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Its arrays and the rest."""
    arrays = {name: value for name, value in vars(data).items() if isinstance(value, np.ndarray)}
    return arrays, {name: getattr(data, name) for name in FACTS}


def received(arrays: dict[str, np.ndarray], facts: dict[str, Any]) -> MeasuredData:
    """Raises ValueError where it has not the form that the renderer relies on."""
    red, green, blue = map(float, facts["albedo"])
    get = arrays.get
    data = MeasuredData(
        arrays["values"], arrays["theta"], arrays["phi"], arrays["density"], arrays["limits"], (red, green, blue),
        get("visible"), get("facets"), get("areas"), int(facts["symmetry"]), bool(facts["is_relative"]),
        tuple(map(str, facts["warnings"])),
    )  # fmt: skip
    slices = (len(data.phi), len(data.theta))
    shapes: dict[str, tuple[int, ...]] = {
        "phi": slices[:1],
        "theta": slices[1:],
        "limits": (len(data.limits), 3),
        "density": (*slices, *data.density.shape[-2:]),
        "values": (90, 90, 180, 3),
    }
    if data.visible is not None and data.facets is not None and data.areas is not None:
        shapes |= {
            "values": (*data.density.shape, 3),
            "visible": (*slices, *data.visible.shape[-2:]),
            "facets": data.facets.shape[-2:],
            "areas": data.areas.shape[-2:],
        }
    grids = [
        shape[2:4] if len(shape) > 2 else shape
        for name, shape in shapes.items()
        if len(shape) > 1 and name != "limits"
    ]
    fits = all(arrays[name].dtype.str == "<f4" and arrays[name].shape == shape for name, shape in shapes.items())
    if arrays.keys() != shapes.keys() or not fits or not all(slices) or min(min(grid) for grid in grids) < 2:
        raise ValueError(f"measured reflection with {[(name, each.shape) for name, each in arrays.items()]}")
    return data
