"""Single rays against shapes, on the device."""

from __future__ import annotations

from typing import Any

import numpy as np

from gpu import Renderer, RenderSettings, Scene, layout
from gpu.layout.bindings import Slot
from tests.probing import prober_of


def to_world(shape: dict[str, Any]) -> np.ndarray:
    """The matrix (4, 4) of a shape\'s `transform`, by hand."""
    t = shape.get("transform", {})
    rx, ry, rz = (np.radians(a) for a in t.get("rotate", (0, 0, 0)))
    x = np.array([[1, 0, 0], [0, np.cos(rx), -np.sin(rx)], [0, np.sin(rx), np.cos(rx)]])
    y = np.array([[np.cos(ry), 0, np.sin(ry)], [0, 1, 0], [-np.sin(ry), 0, np.cos(ry)]])
    z = np.array([[np.cos(rz), -np.sin(rz), 0], [np.sin(rz), np.cos(rz), 0], [0, 0, 1]])
    out = np.eye(4)
    out[:3, :3] = z @ y @ x @ np.diag(np.broadcast_to(np.asarray(t.get("scale", 1), float), 3))
    out[:3, 3] = t.get("translate", (0, 0, 0))
    return out


def trace(gpu: Renderer, scene: Scene, o: np.ndarray, d: np.ndarray, away: np.ndarray) -> list[np.ndarray]:
    """From origins `o` (n, 3) along `d` (n, 3): where each ray hits, at what place of the shape, and where a ray that
    leaves there towards `away` (n, 3) starts; each (n, 4)."""

    def wide(a: np.ndarray) -> np.ndarray:
        return np.concatenate([a, np.zeros((len(a), 1))], 1).astype(np.float32)

    scene.bind()
    frame = np.zeros((), layout.Uniforms.dtype)
    scene.write_uniforms(frame)
    inputs = {Slot.SUM: wide(o), Slot.COMPENSATION: wide(d), Slot.MOMENTS: wide(away)}
    outputs = (Slot.OUTPUT, Slot.ALBEDO, Slot.NORMAL)
    known = scene.defines(RenderSettings(8, 8)) | {"HAS_ANISOTROPIC": 1}
    return prober_of(gpu).run("rays.comp", len(o), inputs, outputs, known, frame=frame)


def ball_mesh(divisions: int) -> dict[str, Any]:
    """The unit sphere as triangles, without its material."""
    import trimesh

    mesh = trimesh.creation.icosphere(divisions)
    return {"type": "mesh", "vertices": mesh.vertices.tolist(), "faces": mesh.faces.tolist(), "smooth": False}
