"""Nodes: where shapes stand, the camera and the lights."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from service.document import AnyCamera, Camera, Scene
from service.document.base import Named
from service.document.camera import OrthographicCamera, PerspectiveCamera
from service.document.light import DirectionalLight, Light, PointLight, SpotLight
from service.document.numbers import Vec3
from service.exports.gltf.builder import Builder, Tree
from service.exports.losses import Losses
from service.formats.types import Doubles

SHEARED = 1e-7  # cosine between axes of a matrix from which on it is no translation, rotation and scale
NEAR = 1e-3  # of the distance to the target: where a rasteriser begins to draw
FAR = 1e3  # the same: where it ends
SHARP = 1 - 1e-6  # of the outer angle, which glTF wants to be above the inner one


class Nodes:
    """The nodes of the scene. Names with slashes become groups, as far as neighbours share them."""

    def __init__(self, builder: Builder) -> None:
        self.builder = builder
        self.roots: list[int] = []
        self._groups: list[tuple[str, int]] = []  # those that are open: name, index

    def add(self, node: Tree, named: Named | None = None, matrix: Doubles | None = None) -> None:
        """A node under a matrix (4, 4) from its space to the world."""
        *groups, name = (getattr(named, "name", None) or "").split("/")
        self._open(groups)
        if name:
            node["name"] = name
        if matrix is not None and _is_sheared(matrix):
            # A turn, a stretch and another turn [singular value decomposition], as a node cannot shear.
            u, s, v = np.linalg.svd(matrix[:3, :3])
            outer, inner = np.eye(4), np.eye(4)
            sign = np.sign(np.linalg.det(u))
            outer[:3, :3], outer[:3, 3] = u * sign * s, matrix[:3, 3]
            inner[:3, :3] = v * sign
            node["matrix"] = _columns(inner)
            parent = {key: node.pop(key) for key in ("name",) if key in node}
            index = self.builder.add("nodes", node)
            node = {**parent, "matrix": _columns(outer), "children": [index]}
        elif matrix is not None and (matrix != np.eye(4)).any():
            node["matrix"] = _columns(matrix)
        self._append(self.builder.add("nodes", node))

    def _open(self, names: list[str]) -> None:
        common = 0
        while common < min(len(names), len(self._groups)) and self._groups[common][0] == names[common]:
            common += 1
        del self._groups[common:]
        for name in names[common:]:
            index = self.builder.add("nodes", {**({"name": name} if name else {}), "children": []})
            self._append(index)
            self._groups.append((name, index))

    def _append(self, index: int) -> None:
        siblings = self.builder.tree["nodes"][self._groups[-1][1]]["children"] if self._groups else self.roots
        siblings.append(index)


def add_camera(camera: Camera, nodes: Nodes, losses: Losses) -> None:
    if type(camera) not in _LENSES:
        losses.add("/camera/type", f"glTF has no {camera.type} cameras: there is no camera in the file")
        return
    for name in sorted(camera.model_fields_set - {*_CAMERA}):
        if getattr(camera, name) not in (type(camera).model_fields[name].default, None):
            losses.add(f"/camera/{name}", "this has no place in glTF and is left out")
    position, target = np.array(camera.position, float), np.array(camera.target, float)
    distance = math.hypot(*(target - position))
    forward = (target - position) / distance
    right = np.cross(forward, np.array(camera.up, float) / math.hypot(*camera.up))
    right /= math.hypot(*right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, np.cross(right, forward), -forward], axis=1)
    matrix[:3, 3] = position
    lens = _LENSES[type(camera)](camera, distance, losses)
    index = nodes.builder.add("cameras", {"type": camera.type, camera.type: lens})
    nodes.add({"camera": index}, None, matrix)


def _perspective(camera: PerspectiveCamera, distance: float, losses: Losses) -> Tree:
    if camera.aperture_radius > 0:
        losses.add("/camera/aperture_radius", "glTF's cameras have no depth of field: everything is sharp")
    return {"yfov": math.radians(camera.vfov), "znear": NEAR * distance}


def _orthographic(camera: OrthographicCamera, distance: float, losses: Losses) -> Tree:
    half = camera.height / 2
    return {"xmag": half, "ymag": half, "znear": 0.0, "zfar": FAR * distance}


_LENSES: dict[type[AnyCamera], Callable[[Any, float, Losses], Tree]] = {
    PerspectiveCamera: _perspective, OrthographicCamera: _orthographic,
}  # fmt: skip
_CAMERA = ("position", "target", "up", "vfov", "aperture_radius", "focus_distance", "height", "type")


def add_lights(scene: Scene, nodes: Nodes, losses: Losses) -> None:
    listed: list[Tree] = []
    for i, light in enumerate(scene.lights):
        if type(light) not in _LIGHTS:
            losses.add(f"/lights/{i}", f"glTF has no {light.type} lights: it is left out")
            continue
        used = nodes.builder.extension("KHR_lights_punctual", {"light": len(listed)})
        listed.append(_light(light, f"/lights/{i}", losses))
        nodes.add({"extensions": used}, light, _light_matrix(light))
    if listed:
        nodes.builder.tree["extensions"] = nodes.builder.extension("KHR_lights_punctual", {"lights": listed})


def _light(light: Light, pointer: str, losses: Losses) -> Tree:
    """A watt per steradian counts as a candela, a watt per square metre as a lux: the importer has it so, too."""
    power, more = _LIGHTS[type(light)](light, pointer, losses)
    brightest = max(power)
    # A power of two, so that colour and intensity multiply to the very numbers of the document.
    intensity = 2.0 ** math.ceil(math.log2(brightest)) if brightest > 0 else 0.0
    color = [each / intensity for each in power] if brightest > 0 else [1.0, 1.0, 1.0]
    made: Tree = {"type": light.type, "color": color, "intensity": intensity, **more}
    for name in sorted(light.model_fields_set - _LIGHT):
        if getattr(light, name) not in (type(light).model_fields[name].default, None):
            losses.add(f"{pointer}/{name}", _DETAILS.get(name, "this has no place in glTF and is left out"))
    return made


def _point(light: PointLight, pointer: str, losses: Losses) -> tuple[Vec3, Tree]:
    return light.intensity, {}


def _spot(light: SpotLight, pointer: str, losses: Losses) -> tuple[Vec3, Tree]:
    inner, outer = math.radians(light.inner_angle), math.radians(light.outer_angle)
    if inner >= outer:
        losses.add(f"{pointer}/inner_angle", "the sharp edge of the cone becomes a fade over a millionth of it")
        outer = max(outer, 1e-6)
        inner = SHARP * outer
    return light.intensity, {"spot": {"innerConeAngle": inner, "outerConeAngle": outer}}


def _directional(light: DirectionalLight, pointer: str, losses: Losses) -> tuple[Vec3, Tree]:
    return light.irradiance, {}


# The strength of each kind of light, and what glTF says of it besides.
_LIGHTS: dict[type[Light], Callable[[Any, str, Losses], tuple[Vec3, Tree]]] = {
    PointLight: _point, SpotLight: _spot, DirectionalLight: _directional,
}  # fmt: skip
_LIGHT = {"type", "name", "position", "direction", "intensity", "irradiance", "inner_angle", "outer_angle"}
_DETAILS = {"angular_diameter": "glTF's distant lights have no size: shadows get sharp"}


def _light_matrix(light: Light) -> Doubles:
    """Shining along -Z, at its place."""
    matrix = np.eye(4)
    direction: Any = getattr(light, "direction", None)
    if direction is not None:
        back = -np.array(direction, float) / math.hypot(*direction)
        side = np.cross(np.eye(3)[int(np.abs(back).argmin())], back)
        side /= math.hypot(*side)
        matrix[:3, :3] = np.stack([side, np.cross(back, side), back], axis=1)
    position = getattr(light, "position", None)
    if position is not None:
        matrix[:3, 3] = position
    return matrix


def _is_sheared(matrix: Doubles) -> bool:
    axes = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
    return bool(np.abs(axes.T @ axes - np.eye(3)).max() > SHEARED)


def _columns(matrix: Doubles) -> list[float]:
    """Column by column, as glTF has it; without -0."""
    numbers: list[float] = (matrix.T.reshape(-1) + 0.0).tolist()
    return numbers
