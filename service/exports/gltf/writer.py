"""A scene as a GLB; a material, on a ball, as a .gltf."""

from __future__ import annotations

from inspect import get_annotations

import numpy as np

from service.document import Scene
from service.document.shape import MeshShape, Shape, SphereShape
from service.document.texture import references
from service.exports.gltf.builder import Builder, Tree
from service.exports.gltf.material_writer import Asked
from service.exports.gltf.materials import Materials
from service.exports.gltf.meshes import Meshes, Part
from service.exports.gltf.placing import Nodes, add_camera, add_lights
from service.exports.gltf.tessellated import tessellated
from service.exports.gltf.textures import Textures
from service.exports.losses import Losses
from service.exports.writing import Exported, Files, Limits
from service.problems import escaped

UNLIT = {"extras": {"sunbox": {"environment": "none"}}}  # our importer puts no sky around the scene then


def write_scene(scene: Scene, files: Files, limits: Limits) -> Exported:
    """The scene as a GLB. Raises InvalidDocument with pointers from the scene's root, TooLarge."""
    writer = _Writer(scene, files, limits)
    writer.everything()
    return Exported(writer.builder.glb(), writer.losses)


def write_material(scene: Scene, files: Files, limits: Limits) -> Exported:
    """The only material of a scene without shapes as a .gltf that shows it on a ball. Raises as `write_scene`."""
    writer = _Writer(scene, files, limits)
    (name,) = scene.materials
    writer.ball(name)
    return Exported(writer.builder.gltf(), writer.losses)


class _Writer:
    def __init__(self, scene: Scene, files: Files, limits: Limits) -> None:
        self.scene = scene
        self.losses, self.builder = Losses(), Builder(limits)
        self.textures = Textures(scene, self.builder, files, limits, self.losses)
        self.materials = Materials(scene, self.builder, self.textures, self.losses)
        self.meshes = Meshes(self.builder, files, limits, self.losses)
        self.nodes = Nodes(self.builder)
        self._meshes: dict[tuple[int, int], int] = {}

    def everything(self) -> None:
        scene = self.scene
        if scene.environment is not None:
            self.losses.add("/environment", "glTF has no environment: the scene keeps its lights alone")
        for i, shape in enumerate(scene.shapes):
            self._shape(i, shape)
        add_lights(scene, self.nodes, self.losses)
        add_camera(scene.camera, self.nodes, self.losses)
        used = {shape.material for shape in scene.shapes}
        for name in scene.materials:
            if name not in used:
                self.losses.add(f"/materials/{escaped(name)}", "no shape has this material; it is left out")
        self._finish(UNLIT if scene.environment is None else {})

    def ball(self, name: str) -> None:
        shape = SphereShape(type="sphere", material=name, center=(0.0, 0.0, 0.0), radius=1.0)
        solid = tessellated(shape)
        part = self.meshes.of_solid(solid, 0)
        self.nodes.add({"mesh": self._mesh(part, self.materials.index(name, Asked(thickness=2.0))), "name": name})
        self._finish({})

    def _finish(self, more: Tree) -> None:
        self.builder.tree |= {"scene": 0, "scenes": [{"nodes": self.nodes.roots, **more}]}

    def _shape(self, i: int, shape: Shape) -> None:
        pointer, name = f"/shapes/{i}", shape.material
        matrix = np.eye(4) if shape.transform is None else shape.transform.matrix4()
        single = self.materials.is_single_sided(name)
        if isinstance(shape, MeshShape):
            part = self.meshes.of_mesh(shape, i)
            double = shape.double_sided
            if part.is_rounded and references(self.scene.materials[name]):
                detail = "texture coordinates are rounded by up to 0.00000006, as glTF counts v from the top"
                self.losses.add(pointer, detail)
            if double and single:
                self.losses.add(pointer, "it shines from its front alone, so glTF leaves out its back")
        else:
            solid = tessellated(shape)
            part, matrix = self.meshes.of_solid(solid, i), matrix @ solid.matrix
            double = True
            self.losses.add(pointer, f"the {shape.type} is written as {len(solid.faces)} triangles")
            if single and solid.is_sheet:
                self.losses.add(pointer, "it shines from its front alone, so glTF leaves out its back")
        double = double and not single
        for field in sorted(shape.model_fields_set & _LEFT_OUT.keys()):
            if getattr(shape, field) != type(shape).model_fields[field].default:
                self.losses.add(f"{pointer}/{field}", _LEFT_OUT[field])
        self._others(shape, pointer)
        scale = float(np.linalg.norm(matrix[:3, :3], axis=0).min())
        asked = Asked(double, part.fades, part.extent * scale)
        self.nodes.add({"mesh": self._mesh(part, self.materials.index(name, asked))}, shape, matrix)

    def _others(self, shape: Shape, pointer: str) -> None:
        written = _WRITTEN if isinstance(shape, MeshShape) else _WRITTEN | get_annotations(type(shape)).keys()
        for field in sorted(shape.model_fields_set - written - _LEFT_OUT.keys()):
            if getattr(shape, field) not in (type(shape).model_fields[field].default, None):
                self.losses.add(f"{pointer}/{field}", "this has no place in glTF and is left out")

    def _mesh(self, part: Part, material: int) -> int:
        key = part.primitive["indices"], material
        if key not in self._meshes:
            primitive = {**part.primitive, "material": material}
            self._meshes[key] = self.builder.add("meshes", {"primitives": [primitive]})
        return self._meshes[key]


_LEFT_OUT = {"visible_to_camera": "glTF cannot hide a shape from the camera alone; it is seen"}
_WRITTEN = {
    "type", "name", "material", "transform", "asset", "vertices", "faces", "normals", "uvs", "colors", "smooth",
    "double_sided",
}  # fmt: skip
