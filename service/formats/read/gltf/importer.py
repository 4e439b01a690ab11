"""A glTF file as a scene document, and the meshes and images that it refers to."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from service.formats.errors import ParseError
from service.formats.read.archive import Archive
from service.formats.read.gltf import animations, lights_and_camera, variants
from service.formats.read.gltf.bad_rows import usable
from service.formats.read.gltf.beside import Beside
from service.formats.read.gltf.deform import Skin, morphed, weights
from service.formats.read.gltf.document import GltfDocument
from service.formats.read.gltf.extensions import note_unsupported
from service.formats.read.gltf.json_view import JsonView, whole
from service.formats.read.gltf.materials import Materials
from service.formats.read.gltf.nodes import Node, Nodes, instances
from service.formats.read.gltf.primitives import Primitive, exporter_notes, read_primitive
from service.formats.read.gltf.textures import Textures
from service.formats.read.scenes import metering
from service.formats.read.scenes.framing import framed
from service.formats.read.scenes.names import LONGEST
from service.formats.read.scenes.part_files import PartFiles
from service.formats.read.scenes.placements import Part, Placements
from service.formats.read.scenes.ply_writer import ply
from service.formats.read.scenes.room import stand_inside
from service.formats.read.scenes.warnings import Warnings
from service.formats.types import AssetLimits, Pose, SceneFile


def read_scene(data: bytes | memoryview, limits: AssetLimits, pose: Pose | None = None) -> SceneFile:
    """The scene of a glTF file, as it was saved or in a pose. Raises ParseError."""
    return _Importer(GltfDocument(data, limits), pose or Pose(), Warnings()).run()


def read_zipped_scene(archive: Archive, path: str, limits: AssetLimits, pose: Pose | None = None) -> SceneFile:
    """The scene of the glTF file at this path of a zip, likewise. Raises ParseError."""
    notes = Warnings()
    file = GltfDocument(archive.read(path), limits, Beside(archive, path, notes))
    return _Importer(file, pose or Pose(), notes).run()


class _Importer:
    def __init__(self, file: GltfDocument, pose: Pose, notes: Warnings) -> None:
        self.file, self.notes, self.files = file, notes, PartFiles()
        self.animations, self.variants = animations.listed(file, self.notes), variants.listed(file)
        if pose.variant is not None:
            variants.choose(file, pose.variant)
        if pose.animation is not None:
            animations.pose(file, pose.animation, pose.time, self.notes)
        self.nodes = Nodes(file, self.notes)
        self.textures = Textures(file, self.notes, self.files.add)
        self.materials = Materials(file, self.textures, self.notes)
        self.placements = Placements()
        self._counted: set[str] = set()  # references of parts
        self._triangles = 0  # of these
        self._read: dict[str, Primitive | None] = {}
        self._parts: dict[tuple[Any, ...], Part | None] = {}

    def run(self) -> SceneFile:
        file, shown = self.file, self.nodes.shown
        for node in shown:
            if "mesh" in node.place:
                self._mesh(node)
        lights = lights_and_camera.lights(file, shown, self.notes)
        self._unread()
        shapes = self.placements.shapes(self.notes)
        if not shapes:
            raise self.notes.nothing_left()
        around = self.placements.bounds
        found, aspect = lights_and_camera.camera(file, shown, around, self.notes)
        camera = found or framed(around)
        document = {
            "version": 1,
            "camera": camera,
            "lights": lights,
            "textures": self.textures.documents,
            "materials": self.materials.documents,
            "shapes": shapes,
        }
        used = {name: value for name, value in document.items() if value or name in ("materials", "shapes")}
        lighting = Warnings()
        is_dark = _is_dark(file)
        remark = (
            None if is_dark else stand_inside(used, self.placements.placed(), around, has_camera=found is not None)
        )
        if remark is not None:
            lighting.add("", remark)
        exposure = self._metered(used, aspect, lighting) if lights else None
        warnings = [*lighting.document(), *self.notes.document()]  # warnings about the whole picture come first
        triangles = sum(part.triangles for part in self.placements.shown)
        bounds = [corner.tolist() for corner in around]
        is_lit = bool(lights) or is_dark
        return SceneFile(
            used, self.files.parts, warnings, triangles, is_lit, exposure, aspect, bounds, self.variants,
            self.animations,
        )  # fmt: skip

    def _metered(self, document: dict[str, Any], aspect: float | None, notes: Warnings) -> float | None:
        """The exposure that suits the file's lights, None where 0 does. Both this and the missing sky are noted."""
        place = "/extensions/KHR_lights_punctual"
        stops = metering.exposure(document, self.placements.placed(), aspect)
        if stops is not None:
            side = "above" if stops < 0 else "below"
            exposed = f"the file's lights expose the picture {abs(stops):g} stops {side} middle grey"
            notes.add(place, f"{exposed}; they are kept as they are, and an exposure of {stops:g} suits them")
        notes.add(place, "the file has lights and no environment: there is no sky, and the background is empty")
        return stops

    def _mesh(self, node: Node) -> None:
        mesh = self.file.follow(node.place, "mesh", "meshes")
        morph = weights(node.place, mesh)
        skin = None
        if "skin" in node.place:
            skin = Skin(self.file, self.file.follow(node.place, "skin", "skins"), self.nodes)
        worlds = np.eye(4)[None] if skin else instances(self.file, node)
        primitives = list(mesh.objects("primitives"))
        path = _named(node, mesh)
        for place in primitives:
            part = self._part(place, morph, skin, node)
            if part is not None:
                name = f"{path}/{part.shape['material']}" if path and len(primitives) > 1 else path
                self.placements.add(part, node.place.pointer, worlds, name)

    def _part(self, place: JsonView, morph: tuple[float, ...], skin: Skin | None, node: Node) -> Part | None:
        """The part of one primitive in one pose; a skinned one belongs to its node alone."""
        key = place.pointer, morph, node.index if skin else None
        if key not in self._parts:
            if place.pointer not in self._read:
                self._read[place.pointer] = read_primitive(self.file, place, self.notes)
            primitive = self._read[place.pointer]
            if primitive is not None:
                primitive = morphed(self.file, primitive, place, morph) if morph else primitive
                primitive = skin.posed(primitive, place) if skin else primitive
                primitive = self._asked(primitive, place)
            self._parts[key] = self._write(primitive, place) if primitive else None
        return self._parts[key]

    def _asked(self, primitive: Primitive, place: JsonView) -> Primitive:
        """The primitive without tangents and without its colours' alpha, where its material does not use them."""
        material = self.materials.place(place)
        coat = material.extension("KHR_materials_clearcoat")
        bent = "normalTexture" in material or (coat is not None and "clearcoatNormalTexture" in coat)
        directed = bent or material.extension("KHR_materials_anisotropy") is not None
        fades = material.text("alphaMode", "OPAQUE") != "OPAQUE"
        colors = primitive.colors
        if colors is not None and colors.shape[1] == 4 and not (fades and (colors[:, 3] != 1).any()):
            colors = colors[:, :3]
        return replace(primitive, tangents=primitive.tangents if directed else None, colors=colors)

    def _write(self, whole: Primitive, place: JsonView) -> Part | None:
        primitive = usable(whole, place, self.notes)
        if primitive is None:
            return None
        vertices = primitive.vertices
        charts = [None if uv is None else np.column_stack([uv[:, 0], 1 - uv[:, 1]]) for uv in primitive.uvs]
        data = ply(vertices, primitive.faces, primitive.normals, charts, primitive.colors, primitive.tangents)
        reference = self.files.add_mesh(data, place.pointer, vertices, len(primitive.faces))
        self._triangles += 0 if reference in self._counted else len(primitive.faces)
        self._counted.add(reference)
        limit = self.file.limits.max_triangles
        if self._triangles > limit:
            raise ParseError(f"the scene has more than the {limit} triangles allowed")
        name, material = self.materials.name(place, tuple(uv is not None for uv in primitive.uvs))
        tinted = primitive.colors is not None and bool((primitive.colors[:, :3] != 1).any())
        if tinted and material.extension("KHR_materials_unlit") is not None:
            self.notes.add(
                place.need("attributes").at("COLOR_0"),
                "vertex colours on an unlit material are not supported; they are ignored",
            )
        sides = {"double_sided": material.flag("doubleSided")}
        shape = {"type": "mesh", "asset": reference, "material": name} | sides
        if primitive.normals is None and not primitive.is_smooth:  # the specification demands flat triangles then
            shape["smooth"] = False
        return Part(shape, vertices, primitive.faces)

    def _unread(self) -> None:
        """Warn about everything else in the file that would change the picture."""
        root = self.file.root
        if self.file.count("scenes") > 1:
            self.notes.add("/scenes", f"only scene {whole(root.value.get('scene', 0), '/scene')} is shown")
        note_unsupported(root, self.notes)


def _is_dark(file: GltfDocument) -> bool:
    """True if an exporter of ours says that nothing surrounds the scene: then no default environment lights it."""
    if not file.count("scenes"):
        return False
    scene = file.item("scenes", file.root.value.get("scene", 0), "/scene")
    return exporter_notes(scene).get("environment") == "none"


def _named(node: Node, mesh: JsonView) -> str:
    """The name of a node's mesh: the node's path; below that, by its own name, where the node has children, too."""
    mesh_name = "-".join(mesh.text("name", "").split("/"))[:LONGEST]
    if not node.path:
        return mesh_name
    return f"{node.path}/{mesh_name or 'Mesh'}" if node.place.array("children") else node.path
