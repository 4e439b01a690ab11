"""The scene document: what is taken, and what it becomes. What is refused is in test_refusals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from service.document import MeshShape, Scene, load_json, parse_scene
from service.problems import MalformedJson
from tests.counting import python_lines

CAMERA = {"position": [0, 1, 4], "target": [0, 0.5, 0]}
GREY = {"type": "diffuse", "albedo": 0.5}
TRIANGLE = {"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]]}


def scene(*shapes: dict[str, Any], **fields: Any) -> Scene:
    return parse_scene({"version": 1, "camera": CAMERA, "materials": {"a": GREY}, "shapes": list(shapes), **fields})


def matrix(transform: dict[str, Any]) -> np.ndarray:
    sphere = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "a"}
    placed = scene({**sphere, "transform": transform}).shapes[0].transform
    assert placed is not None
    return placed.matrix4()


def test_defaults() -> None:
    empty = scene(materials={"d": {"type": "disney"}}, environment={"type": "constant", "radiance": 1})
    camera, disney = empty.camera, empty.materials["d"]
    assert (camera.up, camera.vfov, camera.aperture_radius, camera.focus_distance) == ((0, 1, 0), 40, 0, None)
    assert empty.lights == [] and scene().environment is None
    assert empty.environment is not None
    assert (empty.environment.rotation, empty.environment.scale, empty.environment.background) == (0, 1, True)
    assert disney.model_dump() == {
        "type": "disney", "base_color": (0.5, 0.5, 0.5), "subsurface": 0, "metallic": 0, "specular": 0.5,
        "specular_tint": 0, "roughness": 0.5, "anisotropic": 0, "sheen": 0, "sheen_tint": 0.5, "clearcoat": 0,
        "clearcoat_gloss": 1, "emission": (0, 0, 0), "emission_sides": "front", "alpha": 1, "alpha_cutoff": None,
        "normal_map": None,
        "height": None,
    }  # fmt: skip
    mesh = scene({"type": "mesh", "asset": "bunny.obj", "material": "a"}).shapes[0]
    assert isinstance(mesh, MeshShape) and mesh.double_sided and mesh.transform is None
    assert mesh.smooth is None, "the file decides"


@pytest.mark.parametrize(
    ("written", "linear"),
    [
        ([0.1, 0.2, 0.3], (0.1, 0.2, 0.3)),
        (0.25, (0.25, 0.25, 0.25)),
        (1, (1, 1, 1)),
        ("#ffffff", (1, 1, 1)),
        ("#000000", (0, 0, 0)),
        # .0031308 x 12.92 is the joint of the two pieces: byte 10 lies on the line, byte 11 on the curve.
        ("#0A0b80", (10 / 255 / 12.92, ((11 / 255 + 0.055) / 1.055) ** 2.4, ((128 / 255 + 0.055) / 1.055) ** 2.4)),
    ],
)
def test_forms_of_a_colour(written: Any, linear: tuple[float, float, float]) -> None:
    material = scene(materials={"a": {"type": "diffuse", "albedo": written, "emission": written}}).materials["a"]
    assert material.albedo == pytest.approx(linear, abs=1e-12) and material.emission == material.albedo


def test_rotations_are_right_handed_about_x_first() -> None:
    about_y = matrix({"rotate": [0, 90, 0]})
    assert np.array_equal(about_y @ [0, 0, 1, 1], [1, 0, 0, 1]), "R_y(90) takes +Z to +X"
    turned = matrix({"rotate": [90, 0, 90]})
    assert np.array_equal(turned @ [0, 1, 0, 1], [0, 0, 1, 1]), "Y to Z about X, which Z leaves there"
    assert np.array_equal(turned @ [0, 0, 1, 1], [1, 0, 0, 1]), "Z to -Y about X, then to X about Z"


@pytest.mark.parametrize("degrees", [0, 30, 90, -90, 123.4, 270, -500, 3600.5])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_rotation_about_an_axis(axis: int, degrees: float) -> None:
    angles = [0.0, 0.0, 0.0]
    angles[axis] = degrees
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    expected = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    expected[i, i], expected[i, j], expected[j, i], expected[j, j] = c, -s, s, c
    assert matrix({"rotate": angles})[:3, :3] == pytest.approx(expected, abs=1e-13)


def test_parts_make_t_rz_ry_rx_s() -> None:
    parts = {"translate": [1, 2, 3], "rotate": [10, 20, 30], "scale": [2, -3, 4]}
    x, y, z = (matrix({"rotate": angles}) for angles in ([10, 0, 0], [0, 20, 0], [0, 0, 30]))
    move, stretch = matrix({"translate": [1, 2, 3]}), np.diag([2, -3, 4, 1])
    assert matrix(parts) == pytest.approx(move @ z @ y @ x @ stretch)
    assert np.array_equal(matrix({"scale": 2}), np.diag([2, 2, 2, 1])) and np.array_equal(matrix({}), np.eye(4))


def test_matrices_are_row_major() -> None:
    rows = [2, 0, 0, 5, 0, 3, 0, 6, 0, 0, -4, 7, 0, 0, 0, 1]
    assert (matrix({"matrix": rows}) @ [1, 1, 1, 1]).tolist() == [7, 9, 3, 1]
    matrix({"matrix": [1e-9, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]})  # thin, but no digit is lost


def test_inline_meshes_become_arrays() -> None:
    mesh = scene({"type": "mesh", **TRIANGLE, "normals": [[0, 0, 2]] * 3, "smooth": False, "material": "a"}).shapes[0]
    assert isinstance(mesh, MeshShape) and mesh.vertices is not None and mesh.faces is not None
    assert mesh.vertices.dtype == np.float64 and mesh.faces.dtype == np.int32
    assert mesh.faces.tolist() == [[0, 1, 2]] and not mesh.vertices.flags.writeable
    whole = scene({"type": "mesh", **TRIANGLE, "faces": [[0.0, 1.0, 2.0]], "material": "a"}).shapes[0]
    assert isinstance(whole, MeshShape) and whole.faces is not None and whole.faces.tolist() == [[0, 1, 2]]


def test_scenes_compare_by_value() -> None:
    mesh = {"type": "mesh", **TRIANGLE, "material": "a"}
    assert scene(mesh) == scene(mesh)
    assert scene(mesh) != scene({**mesh, "vertices": [[0, 0, 1], [1, 0, 0], [0, 1, 0]]})
    assert scene(mesh) != scene({**mesh, "smooth": False})
    assert scene(mesh) != scene({"type": "mesh", "asset": "x", "material": "a"})


@pytest.mark.parametrize(
    "camera",
    [
        {"position": [1e9, 0, 0], "target": [1e9 - 64, 0, 0]},
        {"position": [0, 0, 0], "target": [0, 1e-20, 0], "up": [1e-20, 0, 0]},
        {"position": [0, 0, 0], "target": [0, 1, 1e-5]},
        {"position": [0, 0, 0], "target": [0, 0, -1], "vfov": 1e-3, "aperture_radius": 1, "focus_distance": 1e-9},
        {"position": [0, 0, 0], "target": [0, 0, -1], "vfov": 179.99},
    ],
)
def test_strange_cameras_that_see(camera: dict[str, Any]) -> None:
    scene(camera=camera)


def test_names_may_look_like_anything() -> None:
    names = ["type", "diffuse", "<matrix>", "a/b~c", "", "münchen 🌞"]
    shapes = [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": name} for name in names]
    assert list(scene(*shapes, materials=dict.fromkeys(names, GREY)).materials) == names


def test_a_hundred_thousand_vertices_are_checked_by_as_much_python_as_a_hundred() -> None:
    """All of them at once, in C: a line of Python for each would take seconds."""

    def lines(count: int) -> int:
        rng = np.random.default_rng(7)
        vertices, faces = rng.random((count, 3)).tolist(), rng.integers(0, count, (2 * count, 3)).tolist()
        return python_lines(lambda: scene({"type": "mesh", "vertices": vertices, "faces": faces, "material": "a"}))

    lines(100)  # what is done only once
    assert lines(100_000) == lines(100)


@pytest.mark.parametrize(
    "text", ['{"a": [1, 2.5, "x", null]}', b'\xef\xbb\xbf{"a": 1}', '"\\ud83c\\udf1e"', "[" * 64 + "]" * 64]
)
def test_json_is_read(text: bytes | str) -> None:
    load_json(text)


def test_numbers_that_json_has_not_are_left_to_validation() -> None:
    nan, inf, huge = load_json("[NaN, -Infinity, 1e999]")
    assert math.isnan(nan) and inf == -math.inf and huge == math.inf


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "line 1, column 1"),
        ('{"version": 1,\n "camera": {', "line 2, column 13"),
        ('{"a": 1, "b": {"c": 1, "c": 2}}', "'c' stands twice"),
        (b"\xff\xfe\x00\x01", "byte 0 is not UTF-8"),
        (b'{"a": "\xc3("}', "byte 7 is not UTF-8"),
        ("[" * 65 + "]" * 65, "nested deeper than 64"),
        ('{"a":' * 100_000, "nested deeper than 64"),
        ("[" * 100_000 + "]" * 100_000, "nested deeper than 64"),
        ("9" * 5000, "too many digits"),
        ('{"a": "\\ud800"}', "surrogate"),
        ("{'a': 1}", "line 1"),
        ("[1,]", "line 1"),
    ],
)
def test_malformed_json(text: bytes | str, said: str) -> None:
    with pytest.raises(MalformedJson, match=said):
        load_json(text)
