"""A glTF file as a scene document, and the meshes and images that it refers to."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from service.assets.data import AssetLimits, Doubles, SceneFile, ScenePart
from service.assets.errors import ParseError
from service.assets.gltf import standing
from service.assets.gltf.file import KNOWN, OPTIONAL, GltfFile
from service.assets.gltf.materials import Materials
from service.assets.gltf.nodes import Node, Nodes, instances
from service.assets.gltf.notes import Notes
from service.assets.gltf.place import Place, escaped, whole
from service.assets.gltf.pose import Skin, morphed, weights
from service.assets.gltf.primitives import Primitive, read_primitive
from service.assets.gltf.textures import Chart, Textures
from service.assets.gltf.written import ply
from service.assets.parts import MAX_COORDINATE

MOST_SHAPES = 100_000  # beyond, the document itself is the burden
LEAST_VOLUME = 1e-7  # of the axes at length one: what service.scene.transform takes for invertible
DEEPEST = 32


@dataclass(frozen=True)
class Part:
    """A primitive as it was written, once for all its nodes."""

    reference: str
    bounds: tuple[Doubles, Doubles]
    triangles: int
    charts: tuple[Chart | None, ...]
    colored: bool
    smooth: bool  # without normals triangles are flat, says the specification


@dataclass
class _Files:
    kept: list[ScenePart] = field(default_factory=list)
    numbers: dict[bytes, int] = field(default_factory=dict)

    def keep(self, data: bytes, pointer: str, vertices: int | None = None, triangles: int | None = None) -> str:
        """The reference; the same bytes get the same."""
        if data not in self.numbers:
            self.numbers[data] = len(self.kept)
            self.kept.append(ScenePart(data, pointer, vertices, triangles))
        return f"part:{self.numbers[data]}"


def read_scene(data: bytes | memoryview, limits: AssetLimits) -> SceneFile:
    """Raises ParseError."""
    return _Importer(GltfFile(data, limits)).run()


class _Importer:
    def __init__(self, file: GltfFile) -> None:
        self.file, self.notes, self.files = file, Notes(), _Files()
        self.nodes = Nodes(file)
        self.textures = Textures(file, self.notes, self.files.keep)
        self.materials = Materials(file, self.textures, self.notes)
        self.shapes: list[dict[str, Any]] = []
        self.triangles = 0
        self._held: set[str] = set()  # parts that stand somewhere: nodes share them
        self._holds = 0  # triangles of these
        self._read: dict[str, Primitive | None] = {}
        self._parts: dict[tuple[Any, ...], Part | None] = {}
        self._corners: list[Doubles] = []

    def run(self) -> SceneFile:
        file, shown = self.file, self.nodes.shown
        for node in shown:
            if "mesh" in node.place:
                self._mesh(node)
        lights = standing.lights(file, shown, self.notes)
        self._unread()
        if not self.shapes:
            raise ParseError("its scene has no triangles")
        points = np.concatenate(self._corners)
        bounds = points.min(axis=0), points.max(axis=0)
        document = {
            "version": 1,
            "camera": standing.camera(file, shown, bounds, self.notes),
            "lights": lights,
            "textures": self.textures.documents,
            "materials": self.materials.documents,
            "shapes": self.shapes,
        }
        used = {name: value for name, value in document.items() if value or name in ("materials", "shapes")}
        return SceneFile(used, self.files.kept, self.notes.document(), self.triangles, bool(lights))

    def _mesh(self, node: Node) -> None:
        mesh = self.file.follow(node.place, "mesh", "meshes")
        morph = weights(node.place, mesh)
        skin = None
        if "skin" in node.place:
            skin = Skin(self.file, self.file.follow(node.place, "skin", "skins"), self.nodes)
        for place in mesh.objects("primitives"):
            part = self._part(place, morph, skin, node)
            if part is None:
                continue
            material, described = self.materials.name(place, part.charts)
            self._mention(place, part, described)
            shape = {
                "type": "mesh",
                "asset": part.reference,
                "material": material,
                "double_sided": described.flag("doubleSided"),
            } | ({} if part.smooth else {"smooth": False})
            for world in [np.eye(4)] if skin else instances(self.file, node):
                self._shape(shape, world, part, node)

    def _shape(self, shape: dict[str, Any], world: Doubles, part: Part, node: Node) -> None:
        lengths = np.linalg.norm(world[:3, :3], axis=0)
        if not np.isfinite(world).all() or np.abs(world).max() > MAX_COORDINATE:
            raise ParseError("its matrix, its parents' applied, is not finite or beyond 1e9", node.place.pointer)
        if not lengths.min() > 1e-30 or abs(np.linalg.det(world[:3, :3] / lengths)) < LEAST_VOLUME:
            self.notes.add(node.place.pointer, "its transform makes its mesh flat: left out")
            return
        self.triangles += part.triangles
        if part.reference not in self._held:
            self._held.add(part.reference)
            self._holds += part.triangles
        if self._holds > self.file.limits.max_triangles:
            raise ParseError(f"its nodes hold more than the {self.file.limits.max_triangles} triangles allowed")
        if len(self.shapes) >= MOST_SHAPES:
            raise ParseError(f"its nodes hold more than the {MOST_SHAPES} primitives allowed")
        placed = {} if np.array_equal(world, np.eye(4)) else {"transform": {"matrix": world.reshape(-1).tolist()}}
        self.shapes.append(shape | placed)
        corners = np.stack(np.meshgrid(*zip(*part.bounds, strict=True)), axis=-1).reshape(-1, 3)
        self._corners.append(corners @ world[:3, :3].T + world[:3, 3])

    def _part(self, place: Place, morph: tuple[float, ...], skin: Skin | None, node: Node) -> Part | None:
        """Of one primitive in one pose; a skinned one belongs to its node."""
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

    def _asked(self, primitive: Primitive, place: Place) -> Primitive:
        """The primitive without tangents, and without its colours' alpha, where its material has no use for them."""
        material = self.file.follow(place, "material", "materials") if "material" in place else Place({}, "")
        coat = material.extension("KHR_materials_clearcoat")
        bent = "normalTexture" in material or (coat is not None and "clearcoatNormalTexture" in coat)
        directed = bent or material.extension("KHR_materials_anisotropy") is not None
        fades = material.text("alphaMode", "OPAQUE") != "OPAQUE"
        colors = primitive.colors
        if colors is not None and colors.shape[1] == 4 and not (fades and (colors[:, 3] != 1).any()):
            colors = colors[:, :3]
        return replace(primitive, tangents=primitive.tangents if directed else None, colors=colors)

    def _write(self, primitive: Primitive, place: Place) -> Part:
        vertices = primitive.vertices
        if not np.isfinite(vertices).all() or np.abs(vertices).max() > MAX_COORDINATE:
            raise place.error("attributes", "have a POSITION that is not finite or lies beyond 1e9 m")
        for name, rows in primitive.detail():
            if not np.isfinite(rows).all():
                bad = int(np.flatnonzero(~np.isfinite(rows).all(axis=1))[0])
                raise place.need("attributes").error(name, f"has an item that is not finite: {rows[bad].tolist()}")
        return Part(
            self.files.keep(ply(primitive), place.pointer, len(vertices), len(primitive.faces)),
            (vertices.min(axis=0).astype(np.float64), vertices.max(axis=0).astype(np.float64)),
            len(primitive.faces),
            tuple(uv if uv is None else (uv.min(axis=0), uv.max(axis=0)) for uv in primitive.uvs),
            primitive.colors is not None and bool((primitive.colors[:, :3] != 1).any()),
            primitive.normals is not None,
        )

    def _mention(self, place: Place, part: Part, material: Place) -> None:
        """What a primitive asks for beyond its triangles."""
        attributes = place.need("attributes")
        if part.colored and material.extension("KHR_materials_unlit") is not None:
            self.notes.add(attributes.at("COLOR_0"), "colours don't tint an unlit material")

    def _unread(self) -> None:
        """Notes whatever else the file holds that would change the picture."""
        root = self.file.root
        variants = root.extension("KHR_materials_variants")
        if variants is not None:
            self.notes.add(variants.pointer, "is not chosen from: primitives have the materials they name themselves")
        if root.array("animations"):
            self.notes.add("/animations", "are not played: the file's own pose is shown")
        if self.file.count("scenes") > 1:
            self.notes.add("/scenes", f"only number {whole(root.value.get('scene', 0), '/scene')} is shown")
        stack: list[tuple[Any, str, int]] = [(root.value, "", 0)]
        while stack:
            value, pointer, depth = stack.pop()
            pairs = value.items() if isinstance(value, dict) else enumerate(value)
            for name, inner in pairs:
                at = f"{pointer}/{escaped(name)}"
                if name == "extensions" and isinstance(inner, dict):
                    for unknown in sorted(inner.keys() - KNOWN - OPTIONAL):
                        self.notes.add(f"{at}/{escaped(unknown)}", "is an extension that is not had")
                elif isinstance(inner, dict | list) and name != "extras" and depth < DEEPEST:
                    stack.append((inner, at, depth + 1))
