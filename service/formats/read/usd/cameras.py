"""Cameras -> the document's: the first of the stage."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from service.formats.read.scenes.framing import Bounds
from service.formats.read.scenes.warnings import Warnings
from service.formats.read.usd.walk import Item

INSTEAD = "a perspective camera that shows the whole scene is used instead"
TENTH = 0.1  # scene units: the unit of focal lengths and apertures


def camera(
    items: list[Item], time: Usd.TimeCode, unit: float, bounds: Bounds, notes: Warnings
) -> tuple[dict[str, Any] | None, float | None]:
    """The first camera, and the width of its picture over the height; None where there is none."""
    chosen: dict[str, Any] | None = None
    aspect: float | None = None
    for item in items:
        lens = UsdGeom.Camera(item.prim)
        if chosen is not None:
            notes.add(item.pointer, "this camera is not used; the scene's first camera is used instead")
            continue
        width, height = (
            float(a.Get(time)) for a in (lens.GetHorizontalApertureAttr(), lens.GetVerticalApertureAttr())
        )
        focal = float(lens.GetFocalLengthAttr().Get(time))
        if not (0 < width < 1e6 and 0 < height < 1e6 and 0 < focal < 1e6):
            notes.add(item.pointer, f"a camera without an aperture or a focal length is not supported; {INSTEAD}")
            continue
        for offset in (lens.GetHorizontalApertureOffsetAttr(), lens.GetVerticalApertureOffsetAttr()):
            if offset.Get(time):
                notes.add(item.pointer, "a shifted aperture is not supported; the picture is centred")
        stops = math.log2(max(lens.ComputeLinearExposureScale(time), 1e-30))
        if abs(stops) > 0.01:
            notes.add(item.pointer, f"the camera's exposure of {stops:.3g} stops is not applied")
        chosen, aspect = _placed(item, bounds), width / height
        if lens.GetProjectionAttr().Get(time) == UsdGeom.Tokens.orthographic:
            chosen |= {"type": "orthographic", "height": height * TENTH * unit}
            continue
        chosen["vfov"] = min(max(math.degrees(2 * math.atan(height / 2 / focal)), 1e-3), 179.9)
        stop, focus = (float(a.Get(time) or 0) for a in (lens.GetFStopAttr(), lens.GetFocusDistanceAttr()))
        if stop > 0 and focus > 0:
            chosen |= {"aperture_radius": focal * TENTH * unit / (2 * stop), "focus_distance": focus * unit}
    return chosen, aspect


def _placed(item: Item, bounds: Bounds) -> dict[str, Any]:
    world = item.worlds[0]
    axes = world[:3, :3] / np.maximum(np.linalg.norm(world[:3, :3], axis=0), 1e-30)
    position, forward = world[:3, 3], -axes[:, 2]
    # At the distance of the model, so that turning about the target turns about the model.
    distance = float((sum(bounds) / 2 - position) @ forward)
    size = float(np.linalg.norm(bounds[1] - bounds[0]))
    target = position + forward * (distance if distance > 0.01 * size else max(size, 1.0))
    return {"position": position.tolist(), "target": target.tolist(), "up": axes[:, 1].tolist()}
