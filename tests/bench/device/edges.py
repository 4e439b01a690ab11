"""Whether rays slip between the triangles of a closed mesh: light inside, and the camera outside, in the dark."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import trimesh

from gpu import Renderer
from service.bench.device import stage
from service.document import parse_scene
from service.formats import MeshData
from service.pack import pack
from tests.bench.device.part import Options, Row
from tests.rendering import Images

SIZE, SAMPLES = (512, 512), 64


class _Mesh(Images):
    def __init__(self, mesh: MeshData) -> None:
        super().__init__()
        self._mesh = mesh

    def mesh(self, ref: str) -> MeshData:
        return self._mesh


def meshes() -> dict[str, MeshData]:
    """Closed meshes around the origin."""
    ball = trimesh.creation.icosphere(subdivisions=6, radius=1.0)
    box = trimesh.creation.box((2, 2, 2))
    for _ in range(6):
        box = box.subdivide()
    return {
        name: MeshData(np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int32), None)
        for name, mesh in (("ball", ball), ("box", box))
    }


def rows(options: Options) -> Iterator[Row]:
    size = SIZE if options.scale >= 1 else (128, 128)
    samples = SAMPLES if options.scale >= 1 else 8
    with Renderer(options.device) as renderer:
        for name, mesh in meshes().items():
            for position in ([0, 0, 5], [3.1, 2.3, 2.9]):
                document = {
                    "version": 1,
                    "camera": {"position": position, "target": [0, 0, 0], "vfov": 30},
                    "materials": {"shell": {"type": "diffuse", "albedo": 0.5},
                                  "lamp": {"type": "diffuse", "albedo": 0, "emission": 1e6}},
                    "shapes": [
                        {"type": "mesh", "asset": "m", "material": "shell"},
                        {"type": "sphere", "center": [0, 0, 0], "radius": 0.9, "material": "lamp"},
                    ],
                }  # fmt: skip
                arrays = pack(parse_scene(document), _Mesh(mesh)).arrays
                scene = renderer.load(arrays)
                picture = renderer.picture(scene, stage.settings(size, max_bounces=1))
                while picture.samples < samples:
                    picture.trace(1.0, samples)
                lit = int(np.count_nonzero(picture.read()[..., :3].max(-1) > 0))
                yield {"mesh": name, "triangles": len(mesh.faces), "from": position, "samples": samples,
                       "pixels": size[0] * size[1], "lit": lit, "fine": lit == 0}  # fmt: skip
                picture.release()
                scene.release()
