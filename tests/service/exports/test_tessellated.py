"""Shapes as triangles."""

from __future__ import annotations

import numpy as np
import pytest

from service.document.shape import CylinderShape
from service.exports.gltf.tessellated import tessellated


@pytest.mark.parametrize("caps", [True, False])
def test_a_cylinder_faces_outwards(caps: bool) -> None:
    """By the divergence theorem it has the cylinder's volume; normals are on the outer side of their triangles."""
    shape = CylinderShape(type="cylinder", material="m", base=(-0.5, 1, -1), axis=(1, -2, 2), radius=0.4, caps=caps)
    found = tessellated(shape)
    places = found.vertices @ found.matrix[:3, :3].T + found.matrix[:3, 3]
    a, b, c = (places[found.faces[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    volume = np.pi * 0.4**2 * 3
    # About its middle the side gives two thirds of the volume, and the caps the rest.
    assert np.einsum("ij,ij->", a, across) / 6 == pytest.approx(volume * (1 if caps else 2 / 3), rel=2e-3)
    assert found.normals is not None
    normals = found.normals @ np.linalg.inv(found.matrix[:3, :3])
    assert (np.einsum("ij,ij->i", across, normals[found.faces[:, 0]]) > 0).all()
    assert found.uvs.min() == 0 and found.uvs.max() == 1
