"""FBX, COLLADA, 3DS and X3D as a GLB, by Assimp.

Assimp's reader and its writer of glTF do the work; here stands what the writer leaves out or has otherwise: cameras
and lights, images in other files, numbers that glTF does not allow. Runs in the parsing child, that
ends afterwards: to free what some files have become ends in a crash [Assimp 6.0.5, `aiReleaseImport` of COLLADA].
"""

from __future__ import annotations

import ctypes
import math
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from service.formats.errors import MissingExtra, NoTriangles, ParseError
from service.formats.formats import assimp
from service.formats.read.foreign.glb import Find, Glb

# Of aiPostProcessSteps [assimp/postprocess.h].
JOIN_IDENTICAL_VERTICES, TRIANGULATE, SORT_BY_PRIMITIVE_TYPE = 0x2, 0x8, 0x8000
GLOBAL_SCALE = 0x8000000  # to metres, by the unit that an FBX file says
STEPS = JOIN_IDENTICAL_VERTICES | TRIANGULATE | SORT_BY_PRIMITIVE_TYPE | GLOBAL_SCALE
INCOMPLETE = 0x1  # a flag of a scene without meshes, for whose nodes some readers invent one
KEEP_PIVOTS = b"IMPORT_FBX_PRESERVE_PIVOTS"  # 0: a node's transform is one matrix, not a chain of nodes

DIRECTIONAL, POINT, SPOT = 1, 2, 3  # of aiLightSourceType
LIGHTS = "KHR_lights_punctual"

Matrix = npt.NDArray[np.float64]
_Pointer = ctypes.c_void_p


class _String(ctypes.Structure):
    _fields_ = [("length", ctypes.c_uint32), ("data", ctypes.c_char * 1024)]

    @property
    def text(self) -> str:
        return bytes(self.data)[: self.length].decode("utf-8", "replace")


_Vector = ctypes.c_float * 3


class _Light(ctypes.Structure):
    _fields_ = [
        ("name", _String),
        ("type", ctypes.c_int),
        ("position", _Vector),
        ("direction", _Vector),
        ("up", _Vector),
        ("attenuation", _Vector),
        ("diffuse", _Vector),
        ("specular", _Vector),
        ("ambient", _Vector),
        ("inner", ctypes.c_float),
        ("outer", ctypes.c_float),
        ("size", ctypes.c_float * 2),
    ]


class _Camera(ctypes.Structure):
    _fields_ = [
        ("name", _String),
        ("position", _Vector),
        ("up", _Vector),
        ("look_at", _Vector),
        ("horizontal_fov", ctypes.c_float),
        ("near", ctypes.c_float),
        ("far", ctypes.c_float),
        ("aspect", ctypes.c_float),
        ("orthographic_width", ctypes.c_float),
    ]


class _Scene(ctypes.Structure):
    _fields_ = [
        ("flags", ctypes.c_uint),
        ("root", _Pointer),
        ("mesh_count", ctypes.c_uint),
        ("meshes", _Pointer),
        ("material_count", ctypes.c_uint),
        ("materials", _Pointer),
        ("animation_count", ctypes.c_uint),
        ("animations", _Pointer),
        ("texture_count", ctypes.c_uint),
        ("textures", _Pointer),
        ("light_count", ctypes.c_uint),
        ("lights", ctypes.POINTER(ctypes.POINTER(_Light))),
        ("camera_count", ctypes.c_uint),
        ("cameras", ctypes.POINTER(ctypes.POINTER(_Camera))),
    ]


class _Blob(ctypes.Structure):
    _fields_ = [("size", ctypes.c_size_t), ("data", _Pointer)]


@cache
def _library() -> ctypes.CDLL:
    path = assimp()
    if path is None:
        raise MissingExtra("FBX, COLLADA, 3DS and X3D files need sunbox-server[models] on the server")
    library = ctypes.CDLL(path)
    library.aiCreatePropertyStore.restype = _Pointer
    library.aiSetImportPropertyInteger.argtypes = [_Pointer, ctypes.c_char_p, ctypes.c_int]
    library.aiImportFileFromMemoryWithProperties.restype = ctypes.POINTER(_Scene)
    library.aiImportFileFromMemoryWithProperties.argtypes = [
        ctypes.c_char_p, ctypes.c_uint, ctypes.c_uint, ctypes.c_char_p, _Pointer
    ]  # fmt: skip
    library.aiGetErrorString.restype = ctypes.c_char_p
    library.aiExportSceneToBlob.restype = ctypes.POINTER(_Blob)
    library.aiExportSceneToBlob.argtypes = [ctypes.POINTER(_Scene), ctypes.c_char_p, ctypes.c_uint]
    return library


def is_loaded() -> bool:
    """True if a file was read in this process: what that took is not freed."""
    return _library.cache_info().currsize > 0


def converted(format: str, data: bytes, find: Find) -> Glb:
    """The file in metres with +Y up. `find` gives the files beside it, by the names that it has for them. Raises
    ParseError, MissingExtra."""
    library = _library()
    properties = library.aiCreatePropertyStore()
    library.aiSetImportPropertyInteger(properties, KEEP_PIVOTS, 0)
    scene = library.aiImportFileFromMemoryWithProperties(data, len(data), STEPS, format.encode(), properties)
    if not scene:
        raise ParseError(f"it can't be read: {_reason(library)}")
    if not scene.contents.mesh_count or scene.contents.flags & INCOMPLETE:
        raise NoTriangles("the scene has no triangles: none of its nodes has a mesh that can be read")
    blob = library.aiExportSceneToBlob(scene, b"glb2", 0)
    if not blob:
        raise ParseError(f"it can't be read: {_reason(library)}")
    file = Glb.read(ctypes.string_at(blob.contents.data, blob.contents.size))
    file.drop_extension("FB_ngon_encoding")
    file.mend_accessors()
    _lights(file, scene.contents, is_collada=format == "dae")
    _cameras(file, scene.contents)
    for material in file.root.get("materials", []):
        _material(material, file)
    file.embed(lambda name: find(_first(name)))
    for values in (material.get("pbrMetallicRoughness", {}) for material in file.root.get("materials", [])):
        if "baseColorTexture" in values:  # in these formats it stands in the place of the colour
            values["baseColorFactor"] = [1.0, 1.0, 1.0, values.get("baseColorFactor", [1.0] * 4)[3]]
    return file


def _reason(library: ctypes.CDLL) -> str:
    said = bytes(library.aiGetErrorString() or b"").decode("utf-8", "replace").strip()
    return said[:300] or "Assimp gives no reason"


def _first(name: str) -> str:
    """The first of several URLs of one image: `"a.png""b.gif"` of X3D."""
    return next((part for part in name.split('"') if part.strip()), name)


def _material(material: dict[str, Any], file: Glb) -> None:
    """Numbers that glTF does not allow, and those by which exporters say that they have none."""
    extensions: dict[str, Any] = material.setdefault("extensions", {})
    if extensions.get("KHR_materials_ior", {}).get("ior", 1.5) <= 1.0:  # COLLADA's exporters write 1 for "none"
        del extensions["KHR_materials_ior"]
    emission = material.get("emissiveFactor", [0.0])
    if (most := max(emission)) > 1.0:
        material["emissiveFactor"] = [max(0.0, each / most) for each in emission]
        extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": most}
        used = file.root.setdefault("extensionsUsed", [])
        used += ["KHR_materials_emissive_strength"] if "KHR_materials_emissive_strength" not in used else []
    values = material.get("pbrMetallicRoughness", {})
    for name in ("roughnessFactor", "metallicFactor"):
        if name in values and not 0.0 <= values[name] <= 1.0:
            detail = f"{name} {values[name]:.3g} is not from 0 to 1; the nearest number that is is used instead"
            file.warnings.append(f"the material {material.get('name', '')!r}: {detail}")
            values[name] = min(max(values[name], 0.0), 1.0) if values[name] == values[name] else 0.5
    color = values.get("baseColorFactor")
    if color is not None and color[3] == 0.0:  # exporters that write transparency for opacity
        name = material.get("name", "")
        file.warnings.append(f"the material {name!r} is wholly transparent; it is shown as opaque")
        color[3] = 1.0
    if not extensions:
        del material["extensions"]


def _cameras(file: Glb, scene: _Scene) -> None:
    """Cameras, in nodes of their own under those of their names."""
    for number in range(scene.camera_count):
        camera = scene.cameras[number].contents
        node = _named(file, camera.name.text)
        if node is None:
            continue
        aspect = camera.aspect if camera.aspect > 0 else 1.0
        made: dict[str, Any]
        if camera.orthographic_width > 0:
            half = camera.orthographic_width
            size = {"xmag": half, "ymag": half / aspect, "znear": 0.0, "zfar": max(camera.far, 1.0)}
            made = {"type": "orthographic", "orthographic": size}
        else:
            fov = 2 * math.atan(math.tan(min(max(camera.horizontal_fov, 1e-3), 3.1) / 2) / aspect)
            view = {"yfov": fov, "znear": max(camera.near, 1e-3)}
            made = {
                "type": "perspective",
                "perspective": view | ({"aspectRatio": aspect} if camera.aspect > 0 else {}),
            }
        cameras = file.items("cameras")
        cameras.append(made)
        matrix = _looking(np.array(camera.position), np.array(camera.look_at), np.array(camera.up))
        _under(file, node, {"camera": len(cameras) - 1, "matrix": _columns(matrix)})


def _lights(file: Glb, scene: _Scene, is_collada: bool) -> None:
    """Lights, in nodes of their own under those of their names.

    These formats have no units of light: a light of colour 1 shines on the middle of the model as a lamp of such
    programs does, so that white paper there is white.
    """
    worlds = _worlds(file)
    middle = _middle(file, worlds)
    lights, left_out = list[dict[str, Any]](), 0
    for number in range(scene.light_count):
        light = scene.lights[number].contents
        node = _named(file, light.name.text)
        color = np.maximum(np.array(light.diffuse, np.float64), 0.0)
        if node is None or light.type not in (DIRECTIONAL, POINT, SPOT) or not color.any():
            left_out += 1
            continue
        position, direction = np.array(light.position), np.array(light.direction)
        at = worlds[node][:3, :3] @ position + worlds[node][:3, 3]
        strength = math.pi if light.type == DIRECTIONAL else math.pi * max(float(np.sum((at - middle) ** 2)), 1e-6)
        most = float(color.max())
        made: dict[str, Any] = {"color": (color / most).tolist(), "intensity": strength * most}
        made["type"] = {DIRECTIONAL: "directional", POINT: "point", SPOT: "spot"}[light.type]
        if light.type == SPOT:
            # COLLADA's angle is the whole cone; Assimp takes it for the inner one, and adds to it.
            outer = min(max((light.inner if is_collada else light.outer) / 2, 1e-3), math.pi / 2)
            made["spot"] = {"innerConeAngle": min(max(light.inner / 2, 0.0), 0.999 * outer), "outerConeAngle": outer}
        lights.append(made)
        matrix = _looking(position, direction if direction.any() else np.array([0.0, 0.0, -1.0]), np.array(light.up))
        _under(file, node, {"matrix": _columns(matrix), "extensions": {LIGHTS: {"light": len(lights) - 1}}})
    if left_out:
        file.warnings.append(
            f"{left_out} of the lights are ambient, areas or black; they are not supported and left out"
        )
    if lights:
        file.root.setdefault("extensions", {})[LIGHTS] = {"lights": lights}
        file.root.setdefault("extensionsUsed", []).append(LIGHTS)
        file.warnings.append("its lights have no units; they are as bright as fits the size of the model")


def _named(file: Glb, name: str) -> int | None:
    return next((index for index, node in enumerate(file.root["nodes"]) if node.get("name") == name), None)


def _under(file: Glb, node: int, child: dict[str, Any]) -> None:
    nodes = file.items("nodes")
    nodes.append(child)
    nodes[node].setdefault("children", []).append(len(nodes) - 1)


def _looking(position: Matrix, direction: Matrix, up: Matrix) -> Matrix:
    """(4, 4): a node at `position` whose -z points along `direction` and whose y is near `up`."""
    length = float(np.linalg.norm(direction))
    z = -direction / length if length > 0 else np.array([0.0, 0.0, 1.0])
    x = np.cross(up, z)
    if np.linalg.norm(x) < 1e-6:
        x = np.cross([0.0, 0.0, 1.0] if abs(z[2]) < 0.9 else [1.0, 0.0, 0.0], z)
    x = x / np.linalg.norm(x)
    made = np.eye(4)
    made[:3] = np.stack([x, np.cross(z, x), z, position], axis=1)
    return made


def _columns(matrix: Matrix) -> list[float]:
    """As glTF writes it."""
    return [float(each) for each in matrix.T.reshape(-1)]


def _worlds(file: Glb) -> list[Matrix]:
    """The matrix of each node of Assimp's, which have matrices and no other transforms."""
    nodes = file.root["nodes"]
    found = [np.eye(4) for _ in nodes]
    waiting = [(index, np.eye(4)) for scene in file.root["scenes"] for index in scene["nodes"]]
    while waiting:
        index, above = waiting.pop()
        own = nodes[index].get("matrix")
        found[index] = above if own is None else above @ np.array(own, np.float64).reshape(4, 4).T
        waiting += [(child, found[index]) for child in nodes[index].get("children", ())]
    return found


def _middle(file: Glb, worlds: list[Matrix]) -> Matrix:
    """The middle of the boxes of all meshes where they stand."""
    corners = list[Matrix]()
    for node, world in zip(file.root["nodes"], worlds, strict=True):
        for primitive in file.root["meshes"][node["mesh"]]["primitives"] if "mesh" in node else ():
            box = file.root["accessors"][primitive["attributes"]["POSITION"]]
            corners += [world[:3, :3] @ np.array(box[end], np.float64) + world[:3, 3] for end in ("min", "max")]
    return (np.min(corners, axis=0) + np.max(corners, axis=0)) / 2 if corners else np.zeros(3)
