"""What is compiled and rendered: the built-in scenes, and the shader ball in materials of every kind."""

from __future__ import annotations

from gpu import SceneArrays
from service.bench.device import stage
from service.bench.scenes import BenchAssets
from service.document import parse_scene, presets
from service.pack import pack

BALL = "shader-ball"
MATERIALS = ("gold", "glass", "car-paint", "skin", "soap-film", "marble", "milk", "velvet", "anodised-titanium")
SCENES = tuple(entry["name"] for entry in presets.names("scenes"))
NAMES = (*SCENES, stage.MESH, *(f"{BALL}: {name}" for name in MATERIALS))


def arrays(name: str) -> SceneArrays:
    """Those of a scene, or of "shader-ball: MATERIAL"."""
    scene, _, material = name.partition(": ")
    if not material:
        return stage.arrays(name)
    document, worn = presets.get("scenes", scene), presets.get("materials", material)
    if "type" in worn:
        document["materials"][presets.subject(document)] = worn
    else:  # with textures of its own
        for kind, things in worn.items():
            document.setdefault(kind, {}).update(things)
        document["materials"][presets.subject(document)] = next(iter(worn["materials"].values()))
    return pack(parse_scene(document), BenchAssets()).arrays
