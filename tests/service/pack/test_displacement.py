"""Displaced meshes: where their surface is, that it stays closed, and what they may cost."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import trimesh

from service.document import Scene, parse_scene
from service.pack import pack
from service.pack.cache import PackCache
from service.pack.geometry import displacement
from service.problems import InvalidDocument
from service.server.streams.scene_diff import scene_diff
from tests.documents import CUBE, Few, Shelf, document, mesh, picture, refused

N = 16
ALONG = (np.arange(N) + 0.5) / N
RAMP = picture(np.broadcast_to(ALONG[None, :, None], (N, N, 1)))
NOISE = picture(np.random.default_rng(5).random((N, N, 1)))
PLANE = {
    "vertices": [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]], "faces": [[0, 1, 2], [0, 2, 3]],
    "uvs": [[0, 0], [1, 0], [1, 1], [0, 1]],
}  # fmt: skip


def triangles(shape: Any, image: Any = RAMP, limits: Any = None, texture: Any = None, **height: Any) -> np.ndarray:
    """(n, 3, 3) float64, in the world."""
    material = {"type": "diffuse", "albedo": 0.5, "height": {"texture": "t", "scale": 0.5, **height}}
    scene = document({**shape, "material": "m", "displacement": True}, materials={"m": material},
                     textures={"t": {"asset": "sha256:t", "wrap": "clamp", **(texture or {})}})  # fmt: skip
    made = pack(parse_scene(scene), Shelf(t=image), limits=limits)
    found = made.arrays.triangles
    return np.stack([found["v0"], found["v1"], found["v2"]], 1).astype(float) + np.array(made.arrays.origin)


def test_a_ramp_displaces_a_plane_into_a_tilted_one() -> None:
    found = triangles(mesh(**PLANE, max_edge=0.1)).reshape(-1, 3)
    inside = found[(found[:, 0] > 0.1) & (found[:, 0] < 1.9)]  # beyond its outermost texels an image is level
    np.testing.assert_allclose(inside[:, 2], 0.5 * (inside[:, 0] / 2 - 0.5), atol=1e-6)
    assert len(inside) > 400


@pytest.mark.parametrize("wrap", [["clamp", "mirror"], ["mirror", "repeat"], ["repeat", "clamp"]])
def test_heights_wrap_along_each_axis_by_itself(wrap: list[str]) -> None:
    """A plane on which the image lies thrice both ways, from -1 to 2; away from the edges of the image."""
    both = picture((ALONG[None, :, None] + 2 * ALONG[::-1, None, None]) / 3)
    wide = {**PLANE, "uvs": [[-1, -1], [2, -1], [2, 2], [-1, 2]]}
    found = triangles(mesh(**wide, max_edge=0.1), both, texture={"wrap": wrap}, midlevel=0).reshape(-1, 3)
    uv = found[:, :2] / [2, 1] * 3 - 1
    modes = {
        "clamp": lambda x: np.clip(x, ALONG[0], ALONG[-1]), "repeat": lambda x: x % 1,
        "mirror": lambda x: 1 - abs(x % 2 - 1),
    }  # fmt: skip
    u, v = (modes[each](x) for each, x in zip(wrap, uv.T, strict=True))
    inside = (abs(uv - np.round(uv)) > 1 / N).all(axis=1)
    np.testing.assert_allclose(found[inside, 2], 0.5 * (u + 2 * v)[inside] / 3, atol=1e-6)
    assert inside.sum() > 400


def test_heights_and_edges_are_metres_in_the_world() -> None:
    found = triangles(mesh(**PLANE, max_edge=0.1, transform={"scale": [3, 1, 0.1], "rotate": [0, 0, 90]}))
    x, z = found[..., 1].ravel(), found[..., 2].ravel()
    inside = (x > 0.3) & (x < 5.7)
    np.testing.assert_allclose(z[inside], 0.5 * (x[inside] / 6 - 0.5), atol=1e-6)
    flat = found * [1, 1, 0]
    assert np.linalg.norm(flat - np.roll(flat, 1, axis=1), axis=2).max() <= 0.1 + 1e-6


SPHERE = trimesh.creation.uv_sphere(radius=1, count=[12, 16])
ROUND = SPHERE.vertices
SEAM = np.column_stack([np.arctan2(ROUND[:, 1], ROUND[:, 0]) / (2 * np.pi), np.arccos(np.clip(ROUND[:, 2], -1, 1))])


@pytest.mark.parametrize("smooth", [True, False])
@pytest.mark.parametrize("kind", ["cube", "sphere"])
def test_a_closed_mesh_stays_closed(kind: str, smooth: bool) -> None:
    """Seams of texture coordinates and hard edges included: each corner of the cube has its own for each face."""
    if kind == "cube":
        corners = np.array(CUBE["vertices"], float)[np.array(CUBE["faces"]).ravel()]
        uvs = np.random.default_rng(2).random((36, 2))
        shape = {"vertices": corners.tolist(), "faces": np.arange(36).reshape(-1, 3).tolist()}
    else:
        uvs = SEAM
        shape = {"vertices": ROUND.tolist(), "faces": SPHERE.faces.tolist()}
    move = {"scale": [1, 2, 0.7], "rotate": [20, 30, 40]}
    found = triangles(mesh(**shape, uvs=uvs.tolist(), smooth=smooth, max_edge=0.15, transform=move), NOISE, scale=0.1)
    body = trimesh.Trimesh(found.reshape(-1, 3), np.arange(3 * len(found)).reshape(-1, 3), process=True)
    assert body.is_watertight and body.is_winding_consistent and body.volume > 0
    assert len(found) > 1000


def test_what_has_no_room_is_refused_and_told_what_has(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InvalidDocument) as caught:
        triangles(mesh(**PLANE, max_edge=0.08), limits=Few(1000))
    (error,) = caught.value.errors
    assert error.pointer == "/shapes/0/max_edge" and "SUNBOX_MAX_TRIANGLES" in error.detail
    would_do = float(error.detail.split()[-4])
    assert 200 < len(triangles(mesh(**PLANE, max_edge=would_do), limits=Few(1000))) <= 1000
    with monkeypatch.context() as without:
        without.setattr(displacement, "subdivided", None)
        with pytest.raises(InvalidDocument, match="SUNBOX_MAX_TRIANGLES"):
            triangles(mesh(**PLANE, max_edge=1e-6))  # hopeless: refused before anything is cut
    few = triangles(mesh(**PLANE))  # as the mesh's size wants it
    assert 10_000 < len(few) < 200_000


def test_an_edit_of_the_height_moves_the_mesh_again() -> None:
    cache, shelf = PackCache(), Shelf(t=RAMP)

    def scene(scale: float) -> Scene:
        material = {"type": "diffuse", "albedo": 0.5, "height": {"texture": "t", "scale": scale}}
        return parse_scene(document(mesh(**PLANE, max_edge=0.5, material="m", displacement=True),
                                    materials={"m": material}, textures={"t": {"asset": "sha256:t"}}))  # fmt: skip

    low, same, high = (pack(scene(scale), shelf, cache).arrays.triangles for scale in (0.1, 0.1, 0.2))
    assert same is low and np.ptp(high["v0"][:, 2]) == pytest.approx(2 * np.ptp(low["v0"][:, 2]), rel=1e-4)
    assert scene_diff(scene(0.1), scene(0.2)).whole


def test_what_is_computed_moves_no_mesh() -> None:
    material = {"type": "diffuse", "albedo": 0.5, "height": {"texture": "n"}}
    assert refused(mesh(displacement=True, material="m"), materials={"m": material},
                   textures={"n": {"type": "noise"}}) == ["/materials/m/height/texture"]  # fmt: skip


def test_without_a_height_nothing_is_displaced() -> None:
    made = pack(parse_scene(document(mesh(displacement=True))), Shelf())
    assert len(made.arrays.triangles) == 12 and "no height" in " ".join(made.warnings)
