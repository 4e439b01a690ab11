"""3MF packages as a GLB: the core, materials and production extensions. Runs in the parsing child.

Our own, and not Assimp's: that one finds no objects in other parts of a package, gives each vertex one colour, takes
sRGB for linear, and crashes on objects without triangles [Assimp 6.0.5].
"""

from __future__ import annotations

from collections import Counter
from typing import Any
from xml.parsers.expat import ExpatError

import numpy as np
import numpy.typing as npt

from service.colorimetry import decode_srgb
from service.formats.errors import ParseError
from service.formats.read.archive import Archive
from service.formats.read.bad_elements import counted, left_out, whole_faces
from service.formats.read.foreign.glb import Glb
from service.formats.read.foreign.three_mf_parts import Group, Object, Part, Texture, read_part
from service.formats.types import AssetLimits

# Metres of 3MF's units [3MF core specification 1.3, 3.4]; its z is up, and glTF's y.
METRES = {"micron": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048, "meter": 1.0}
MOST_NODES = 100_000  # of components within components, which would multiply without end
MOST_DEEP = 100
RELATIONS = "_rels/.rels"
FLOAT, UNSIGNED = 5126, 5125
WRAPS = {"wrap": 10497, "mirror": 33648, "clamp": 33071, "none": 33071}
Triangles = npt.NDArray[np.int64]  # rows of Object.triangles


def converted(data: bytes, limits: AssetLimits) -> Glb:
    """The file in metres with +Y up. Raises ParseError."""
    return _Package(Archive(data, limits.max_file)).converted()


class _Package:
    def __init__(self, archive: Archive) -> None:
        self.archive = archive
        self.names = {name.lower(): name for name in archive.names}
        self.parts: dict[str, Part] = {}
        self.file = Glb({"asset": {"version": "2.0"}, "scenes": [{"nodes": []}]}, bytearray())
        self.meshes: dict[tuple[str, str], int | None] = {}
        self.materials: dict[tuple[Any, ...], int] = {}
        self.notes: Counter[str] = Counter()

    def converted(self) -> Glb:
        root = self._root()
        part = self._part(root)
        if not part.items:
            raise ParseError("its build has no items: nothing in it is to be shown")
        for item in part.items:
            node = self._node(item.path or root, item.object, ())
            if node is not None:
                self._placed(node, item.transform)
                self.file.root["scenes"][0]["nodes"].append(node)
        for detail, count in self.notes.items():
            more = f" (here and in {count - 1} more place{'s' if count > 2 else ''})" if count > 1 else ""
            self.file.warnings.append(detail + more)
        if "meshes" not in self.file.root:
            raise ParseError("; ".join(["none of the objects to be shown has triangles", *self.file.warnings]))
        self.file.turn_z_up("3MF", METRES.get(part.unit, METRES["millimeter"]))
        self.file.embed(self._found)
        return self.file

    def _found(self, path: str) -> bytes | None:
        name = self.names.get(path.lower().lstrip("/"))
        return None if name is None else self.archive.read(name)

    def _root(self) -> str:
        """The part that the package's relationships call its model, else the first that may be."""
        models = [name for name in self.names if name.endswith(".model")]
        named = self._part(RELATIONS).models if RELATIONS in self.names else []
        found = next((each for each in named if each.lower().lstrip("/") in self.names), None)
        found = found or next((name for name in models if name.count("/") == 1), None) or next(iter(models), None)
        if found is None:
            raise ParseError("the package has no model: no part of it is called .model")
        return found

    def _part(self, path: str) -> Part:
        key = path.lower().lstrip("/")
        if key not in self.parts:
            data = self._found(path)
            if data is None:
                self.notes[f"the part {path[:100]!r} is not there; what it holds is left out"] += 1
                self.parts[key] = Part()
            else:
                try:
                    self.parts[key] = read_part(data)
                except ExpatError as error:
                    raise ParseError(f"it is no well-formed XML: {error}", path[:100]) from None
                for unread in sorted(self.parts[key].unread):
                    self.notes[f"{unread} are not supported and left out"] += 1
        return self.parts[key]

    def _node(self, path: str, id: str, above: tuple[tuple[str, str], ...]) -> int | None:
        """The number of a new node with the object and its components; None where there is none."""
        key = (path.lower().lstrip("/"), id)
        found = self._part(path).objects.get(id)
        if found is None:
            self.notes[f"the object {id[:40]!r} is not there; it is left out"] += 1
            return None
        if key in above:
            raise ParseError(f"the object {id[:40]!r} is a component of itself")
        if len(above) >= MOST_DEEP:
            raise ParseError(f"components lie within components, more than {MOST_DEEP} deep")
        nodes = self.file.items("nodes")
        if len(nodes) >= MOST_NODES:
            raise ParseError(f"its components make more than {MOST_NODES} objects")
        node: dict[str, Any] = {"name": found.name or f"object {id}"}
        nodes.append(node)
        number = len(nodes) - 1
        if key not in self.meshes:
            self.meshes[key] = self._mesh(path, found)
        if self.meshes[key] is not None:
            node["mesh"] = self.meshes[key]
        for component in found.components:
            child = self._node(component.path or path, component.object, (*above, key))
            if child is not None:
                self._placed(child, component.transform)
                node.setdefault("children", []).append(child)
        return number

    def _placed(self, node: int, transform: list[float]) -> None:
        if len(transform) == 12 and np.isfinite(transform).all():
            rows = np.column_stack([np.reshape(transform, (4, 3)), [0.0, 0.0, 0.0, 1.0]])
            self.file.items("nodes")[node]["matrix"] = rows.reshape(-1).tolist()
        elif transform:
            self.notes["a transform is not 12 numbers; the object stands where it was made"] += 1

    def _mesh(self, path: str, found: Object) -> int | None:
        """The number of the object's mesh: a primitive for each material."""
        part = self._part(path)
        vertices = np.array(found.vertices, np.float64).reshape(-1, 3)
        triangles = np.array(found.triangles, np.int64).reshape(-1, 7)
        whole, reason = whole_faces(
            vertices, triangles[:, :3].reshape(-1), np.full(len(triangles), 3), counted("triangle")
        )
        if not whole.all():
            self.file.warnings.append(left_out(int((~whole).sum()), "triangle", reason))
            triangles = triangles[whole]
        if not len(triangles):
            return None
        primitives = []
        looks, of_triangle = np.unique(triangles[:, 3], return_inverse=True)
        for look, group in enumerate(looks.tolist()):
            rows = triangles[of_triangle == look]
            named = part.groups.get(part.names[group], Group("")) if group >= 0 else None
            primitives += self._primitives(part, named, vertices, rows)
        meshes = self.file.items("meshes")
        meshes.append({"name": found.name or "mesh", "primitives": primitives})
        return len(meshes) - 1

    def _primitives(
        self, part: Part, group: Group | None, vertices: npt.NDArray[np.float64], rows: Triangles
    ) -> list[dict[str, Any]]:
        """Those of triangles whose properties are of one group."""
        corners, places = rows[:, :3], rows[:, 4:]
        if group is not None and group.layers:
            group, places = self._layer(part, group, places)
        if group is None:
            return [self._primitive(vertices, corners, self._material(None, ()))]
        known = ((places >= 0) & (places < len(group.rows))).all(axis=1)
        if not known.all():
            self.notes["some triangles name a property that does not exist; they are shown grey"] += 1
            others = self._primitives(part, group, vertices, rows[known]) if known.any() else []
            return [*others, self._primitive(vertices, corners[~known], self._material(None, ()))]
        if group.kind == "base":
            return [
                self._primitive(vertices, corners[places[:, 0] == each], self._material(part, ("base", group, each)))
                for each in np.unique(places[:, 0]).tolist()
            ]
        values = np.array(group.rows, np.float64)[places.reshape(-1)]
        own = vertices[corners.reshape(-1)]
        alone = np.arange(len(own)).reshape(-1, 3)
        if group.kind == "color":
            values[:, :3] = decode_srgb(values[:, :3])
            is_clear = bool((values[:, 3] < 1).any())
            return [self._primitive(own, alone, self._material(part, ("color", is_clear)), COLOR_0=values)]
        values[:, 1] = 1 - values[:, 1]
        return [self._primitive(own, alone, self._material(part, ("texture", group)), TEXCOORD_0=values)]

    def _layer(self, part: Part, group: Group, places: Triangles) -> tuple[Group | None, Triangles]:
        """Of several properties the one that is shown: a texture, else colours, else the first."""
        layers = [part.groups.get(each) for each in group.layers]
        kinds = ["" if each is None else each.kind for each in layers]
        which = next((kinds.index(kind) for kind in ("texture", "color") if kind in kinds), 0)
        self.notes["of several properties of a triangle one is shown"] += 1
        rows = [[*row, *[0] * len(layers)][which] for row in group.rows]
        safe = np.where((places >= 0) & (places < len(rows)), places, -1)
        return layers[which], np.array([*rows, -1], np.int64)[safe]

    def _material(self, part: Part | None, look: tuple[Any, ...]) -> int:
        key = (id(part), *(id(each) if isinstance(each, Group) else each for each in look))
        if key not in self.materials:
            materials = self.file.items("materials")
            materials.append(self._made(part, look))
            self.materials[key] = len(materials) - 1
        return self.materials[key]

    def _made(self, part: Part | None, look: tuple[Any, ...]) -> dict[str, Any]:
        values: dict[str, Any] = {"metallicFactor": 0.0, "roughnessFactor": 1.0}
        made: dict[str, Any] = {"name": "grey", "pbrMetallicRoughness": values}
        match look:
            case ("base", group, row):
                *color, opacity = group.rows[row]
                values["baseColorFactor"] = [*decode_srgb(np.array(color)).tolist(), opacity]
                made["name"] = group.names[row]
                metal = part.metals.get(group.display) if part is not None else None
                if metal is not None and row < len(metal):
                    values["metallicFactor"], values["roughnessFactor"] = metal[row]
                elif group.display:
                    self.notes["display properties that are not metallic ones are not read"] += 1
                if opacity == 0:  # some write transparency for opacity
                    name = made["name"][:60]
                    self.notes[f"the material {name!r} is wholly transparent; it is shown as opaque"] += 1
                    values["baseColorFactor"][3] = 1.0
                elif opacity < 1:
                    made["alphaMode"] = "BLEND"
            case ("color", is_clear):
                made["name"] = "colours"
                made |= {"alphaMode": "BLEND"} if is_clear else {}
            case ("texture", group):
                texture = part.textures.get(group.display) if part is not None else None
                if texture is None or not texture.path:
                    self.notes["a texture is not there; its surface is shown grey"] += 1
                else:
                    values["baseColorTexture"] = {"index": self._texture(texture)}
                    made["name"] = texture.path.rpartition("/")[2]
        if made["name"] == "grey":
            values["baseColorFactor"] = [0.8, 0.8, 0.8, 1.0]
        return made

    def _texture(self, texture: Texture) -> int:
        images, samplers, textures = (self.file.items(each) for each in ("images", "samplers", "textures"))
        images.append({"uri": texture.path, "name": texture.path.rpartition("/")[2]})
        samplers.append({"wrapS": WRAPS.get(texture.u, 10497), "wrapT": WRAPS.get(texture.v, 10497)})
        textures.append({"source": len(images) - 1, "sampler": len(samplers) - 1})
        return len(textures) - 1

    def _primitive(
        self, vertices: npt.NDArray[np.float64], corners: Triangles, material: int, **more: npt.NDArray[np.float64]
    ) -> dict[str, Any]:
        """With the vertices that it uses; `more` are attributes of all vertices."""
        used, indices = np.unique(corners.reshape(-1), return_inverse=True)
        rows = {"POSITION": vertices} | more
        attributes = {name: self._accessor(values[used].astype("<f4"), FLOAT) for name, values in rows.items()}
        return {
            "attributes": attributes,
            "indices": self._accessor(indices.reshape(-1).astype("<u4"), UNSIGNED),
            "material": material,
        }

    def _accessor(self, values: npt.NDArray[Any], component: int) -> int:
        data = values.tobytes()
        views, accessors = self.file.items("bufferViews"), self.file.items("accessors")
        views.append({"buffer": 0, "byteOffset": len(self.file.data), "byteLength": len(data)})
        self.file.data += data
        kind = "SCALAR" if values.ndim == 1 else f"VEC{values.shape[1]}"
        made = {"bufferView": len(views) - 1, "componentType": component, "count": len(values), "type": kind}
        if kind == "VEC3":
            made |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        accessors.append(made)
        return len(accessors) - 1
