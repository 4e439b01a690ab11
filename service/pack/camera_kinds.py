"""A row for each kind of camera: its number, and what its record says of its lens."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from gpu.layout import CameraKind
from service.document.camera import AnyCamera, OrthographicCamera, PanoramaCamera, PerspectiveCamera


def fill_camera(record: np.void, camera: AnyCamera) -> None:
    """Fill in what depends on the kind of the camera. The record has the distance to the target as its focus."""
    kind, fill = KINDS[type(camera)]
    record["kind"] = kind
    fill(record, camera)


def _perspective(record: np.void, camera: PerspectiveCamera) -> None:
    record["half_height"] = math.tan(math.radians(camera.vfov) / 2)
    record["aperture_radius"] = camera.aperture_radius
    if camera.focus_distance is not None:
        record["focus_distance"] = camera.focus_distance


def _orthographic(record: np.void, camera: OrthographicCamera) -> None:
    record["half_height"] = camera.height / 2


def _panorama(record: np.void, camera: PanoramaCamera) -> None:
    """A panorama shows everything: it has no number of its own."""


KINDS: dict[type[AnyCamera], tuple[CameraKind, Callable[[np.void, Any], None]]] = {
    PerspectiveCamera: (CameraKind.PERSPECTIVE, _perspective),
    OrthographicCamera: (CameraKind.ORTHOGRAPHIC, _orthographic),
    PanoramaCamera: (CameraKind.PANORAMA, _panorama),
}
