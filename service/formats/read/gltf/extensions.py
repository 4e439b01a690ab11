"""glTF's extensions: which ones are read, which do not change a picture, and the warnings about all others."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from service.formats.errors import ParseError
from service.formats.read.gltf.json_view import JsonView, shown
from service.formats.read.scenes.warnings import Warnings
from service.problems import escaped

READ = {
    "KHR_draco_mesh_compression", "KHR_lights_punctual", "KHR_materials_anisotropy", "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission", "KHR_materials_dispersion", "KHR_materials_emissive_strength",
    "KHR_materials_ior", "KHR_materials_iridescence", "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen", "KHR_materials_specular", "KHR_materials_transmission", "KHR_materials_unlit",
    "KHR_materials_variants", "KHR_materials_volume", "KHR_mesh_quantization", "KHR_meshopt_compression",
    "KHR_node_visibility", "KHR_texture_basisu", "KHR_texture_transform", "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression", "EXT_texture_webp",
}  # fmt: skip
# These describe motion, sound, behaviour, meaning, provenance or coarser versions of the model: a still picture
# is the same without them.
UNSEEN = {
    "KHR_animation_pointer", "KHR_audio_emitter", "KHR_implicit_shapes", "KHR_interactivity",
    "KHR_node_hoverability", "KHR_node_selectability", "KHR_physics_rigid_bodies", "KHR_xmp", "KHR_xmp_json_ld",
    "EXT_instance_features", "EXT_mesh_features", "EXT_mesh_manifold", "EXT_structural_metadata", "FB_ngon_encoding",
    "GODOT_single_root", "MSFT_audio_emitter", "MSFT_lod",
}  # fmt: skip
PLAIN = {int, float, str}  # an array that begins with one of these has no objects: most of a file are numbers
DEEPEST = 32  # levels of the file that are searched; a normal file has about ten

Path = tuple[Any, ...]  # (name, path of the parent); () is the root: written out only where it is needed


def check_required(root: JsonView) -> None:
    """Raise ParseError where a file requires an extension that is not read."""
    for k, name in enumerate(root.array("extensionsRequired")):
        if name not in READ | UNSEEN:
            raise ParseError(f"the file requires {shown(name)}, which is not supported", f"/extensionsRequired/{k}")


def note_unsupported(root: JsonView, notes: Warnings) -> None:
    """Warn about each extension that would change the picture, and about each required one that would not."""
    for k, name in enumerate(root.array("extensionsRequired")):
        if name in UNSEEN:
            notes.add(f"/extensionsRequired/{k}", f"{name} is ignored: it changes nothing in a still picture")
    for path, name in _used(root.value):
        if name not in READ | UNSEEN:
            notes.add(_pointer((name, path)), f"{name[:80]} is not supported; the file is shown without it")


def _used(root: dict[str, Any]) -> Iterator[tuple[Path, str]]:
    """Every extension that an object of the file has, with the path of that object."""
    stack: list[tuple[Any, Path, int]] = [(root, (), 0)]
    while stack:
        value, path, depth = stack.pop()
        for name, inner in value.items() if type(value) is dict else enumerate(value):
            kind = type(inner)
            if kind is not dict and (kind is not list or not inner or type(inner[0]) in PLAIN):
                continue
            if name == "extensions" and kind is dict:
                yield from (((name, path), extension) for extension in sorted(inner))
            if name != "extras" and depth < DEEPEST:
                stack.append((inner, (name, path), depth + 1))


def _pointer(path: Path) -> str:
    steps = []
    while path:
        name, path = path
        steps.append(f"/{escaped(name)}")
    return "".join(reversed(steps))
