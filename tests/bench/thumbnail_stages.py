"""What a material is shown on, and in which light: what it is like decides.

Everything stands on a cyclorama, so that no horizon cuts what is seen through. Most are a ball, as the editor shows
edited materials (`web/thumbnails/studio.json`); a shell with a thin lip before a lamp shows light that goes below the
surface; sheets are a window, a leaf and a lantern.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from service.document import presets
from tests.bench import thumbnail_shapes as shapes

Document = dict[str, Any]
SUBJECT = "subject"
STUDIO = Path(__file__).resolve().parents[2] / "web" / "thumbnails" / "studio.json"
BALL: Document = {"type": "sphere", "center": [0, 1, 0], "radius": 1}
DROP = 0.05  # metres: what is clear in a glass of it is shown so small
NEAR = {"car-paint": 0.7}  # radius of the ball whose pattern is shown
DEEP = 1.6  # radius of the ball over the distance at which light is absorbed


def stage(backdrop: float | None = None, ambient: float = 1.0) -> Document:
    """The empty stage: a cyclorama in a photographer's studio; `backdrop` is its albedo."""
    scene: Document = json.loads(STUDIO.read_text())
    cyclorama = presets.get("stages", "cyclorama")
    scene["environment"] = presets.get("environments", "studio")
    if ambient != 1:
        scene["environment"]["scale"] = ambient
    scene["materials"] |= cyclorama["materials"]
    if backdrop is not None:
        for material in cyclorama["materials"].values():
            material["albedo"] = backdrop
    scene["shapes"] = cyclorama["shapes"]
    return scene


def put(scene: Document, material: str, **shape: Any) -> Document:
    scene["shapes"].append({**shape, "material": material})
    return scene


Place = tuple[float, float, float]


def lamp(
    scene: Document, at: Place, size: tuple[float, float], color: list[float], aim: Place = (0.0, 1.0, 0.0)
) -> Document:
    """A softbox at a place, turned to the ball and not seen by the camera."""
    place = np.array(at)
    ahead = np.array(aim) - place
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    # Its normal, u x v, is the way ahead.
    u, v = -right * size[0], up * size[1]
    origin = place - (u + v) / 2
    name = f"lamp {len(scene['shapes'])}"
    scene["materials"][name] = {"type": "diffuse", "albedo": 0, "emission": color}
    corner: dict[str, Any] = {
        key: [round(float(x), 5) for x in vector] for key, vector in (("origin", origin), ("u", u), ("v", v))
    }
    return put(scene, name, type="quad", visible_to_camera=False, **corner)


def ball() -> Document:
    """Just as the editor has it."""
    scene = stage()
    scene["shapes"] = json.loads(STUDIO.read_text())["shapes"] + scene["shapes"]
    return scene


def rim_lit() -> Document:
    """Strips from behind on both sides: they draw the edge of what is black, and of pile that stands up."""
    scene = put(stage(0.12, 0.7), SUBJECT, **BALL)
    lamp(scene, (-2.4, 1.5, -1.5), (0.9, 3.0), [26, 25, 24])
    lamp(scene, (2.4, 1.5, -1.5), (0.9, 3.0), [30, 31, 32.5])
    return lamp(scene, (-2.4, 2.6, 2.0), (0.5, 2.6), [30, 29, 28])


def clear() -> Document:
    """Before a glow in the dark: what bends light is seen by the dark that it gathers at its edge."""
    scene = put(stage(0.5, 0.4), SUBJECT, **BALL)
    lamp(scene, (-2.6, 2.2, 1.4), (0.9, 2.4), [9, 8.8, 8.5])
    lamp(scene, (2.6, 1.8, -0.6), (0.4, 2.6), [12, 12.4, 13])
    return lamp(scene, (0, 2.7, -2.9), (1.3, 0.6), [40, 40, 40], aim=(0, 0.5, -3.7))


def bubble() -> Document:
    """Before black, where nothing outshines the colours of a film."""
    return put(stage(0.05, 0.9), SUBJECT, **BALL)


def drops() -> Document:
    """Drops on dark slate, which gather the light behind them."""
    scene = stage(0.3, 0.8)
    scene["camera"] = {"position": [0, 3.5, 3.9], "target": [0.05, 0.08, 0.16], "vfov": 23.5}
    scene["materials"]["slate"] = {"type": "principled", "base_color": [0.035, 0.075, 0.12], "roughness": 0.42}
    put(scene, "slate", type="quad", origin=[-4, 0.01, 4], u=[8, 0, 0], v=[0, 0, -6.4])
    for x, z, radius in ((-0.22, -0.1, 0.74), (0.72, 0.42, 0.34), (0.74, -0.7, 0.24), (-0.62, 0.95, 0.2)):
        turned = {"translate": [x, 0.01 + 0.12 * radius, z], "scale": [radius, 0.62 * radius, radius]}
        put(scene, SUBJECT, type="sphere", center=[0, 0, 0], radius=1, transform=turned)
    lamp(scene, (-1.6, 3.4, -2.8), (1.3, 1.3), [44, 43, 42])
    return lamp(scene, (2.6, 1.8, -0.8), (0.4, 2.6), [12, 12.4, 13])


def back_lit() -> Document:
    """A shell whose thin lip stands before a lamp."""
    scene = put(stage(0.22, 0.45), SUBJECT, **shapes.shell(), transform=leaning(34, 0, -30, 1.0))
    lamp(scene, (-2.6, 2.4, 2.2), (1.0, 2.0), [7, 6.8, 6.5])
    return lamp(scene, (1.7, 2.5, -2.0), (1.6, 1.6), [17, 16, 14.5])


def leaning(x: float, y: float, z: float, height: float) -> Document:
    return {"rotate": [x, y, z], "translate": [0, height, 0]}


def cut() -> Document:
    """A brilliant among small lamps in a dark room."""
    scene = stage(0.16, 0.35)
    put(
        scene,
        SUBJECT,
        **shapes.brilliant(),
        transform={"rotate": [38, 12, 0], "translate": [0, 0.96, 0], "scale": 1.02},
    )
    for turn in range(7):
        angle = 0.5 + turn * 0.9
        lamp(scene, (3.2 * math.cos(angle), 2.2 + turn % 3, 1.2 + 2.4 * math.sin(angle)), (0.7, 0.7), [26, 26, 26])
    return lamp(scene, (0.6, 4.6, 2.2), (2.2, 1.2), [9, 9, 9])


def window() -> Document:
    """A window that stands before a ball: what passes through it, and what it reflects."""
    scene = stage(0.4, 0.8)
    scene["materials"]["ball"] = {"type": "principled", "base_color": [0.7, 0.16, 0.03], "roughness": 0.35}
    scene["materials"]["frame"] = {"type": "principled", "base_color": [0.035, 0.04, 0.045], "roughness": 0.4}
    put(scene, "ball", type="sphere", center=[-0.42, 0.75, -1.15], radius=0.75)
    turned = {"rotate": [0, -24, 0], "translate": [0.05, 0, -0.1]}
    put(scene, SUBJECT, type="quad", origin=[-0.85, 0.06, 0], u=[1.7, 0, 0], v=[0, 1.86, 0], transform=turned)
    for low, high in ((-0.9, -0.83), (0.83, 0.9)):
        put(scene, "frame", type="box", min=[low, 0.0, -0.05], max=[high, 1.97, 0.05], transform=turned)
        put(scene, "frame", type="box", min=[-0.9, 0.9 + low, -0.05], max=[0.9, 0.9 + high, 0.05], transform=turned)
    lamp(scene, (-3.2, 2.3, 3.0), (0.55, 1.6), [19, 18.5, 18])
    return lamp(scene, (2.4, 2.6, -1.8), (1.0, 2.0), [8, 8, 8])


def leaf() -> Document:
    scene = put(stage(0.25, 0.6), SUBJECT, **shapes.leaf(), transform=leaning(-14, 24, -32, 0.98))
    lamp(scene, (1.5, 2.7, -2.0), (1.6, 1.6), [22, 20, 16])
    return lamp(scene, (-2.4, 2.6, 2.0), (0.9, 1.6), [6, 6, 6])


def lantern() -> Document:
    """A cylinder of paper round a flame."""
    scene = stage(0.3, 0.25)
    scene["materials"]["flame"] = {"type": "diffuse", "albedo": 0, "emission": [26, 17, 8]}
    put(scene, "flame", type="sphere", center=[0, 0.62, 0], radius=0.2)
    return put(scene, SUBJECT, type="cylinder", base=[0, 0.03, 0], axis=[0, 1.8, 0], radius=0.74, caps=False)


def shaded() -> Document:
    """A lamp under its shade, which lights the floor."""
    scene = stage(0.4, 0.3)
    scene["materials"]["shade"] = {"type": "principled", "base_color": [0.05, 0.16, 0.14], "roughness": 0.3}
    scene["materials"]["inside"] = {"type": "diffuse", "albedo": 0.8}
    put(scene, "shade", **shapes.lampshade(), transform={"translate": [0, 0.98, 0], "scale": 0.98})
    return put(scene, SUBJECT, type="sphere", center=[0, 1.02, 0], radius=0.34)


SHOWN: dict[str, Callable[[], Document]] = {
    "velvet": rim_lit, "rough-velvet": rim_lit, "rubber": rim_lit, "oxidized-steel-sgd": rim_lit,
    "walnut-sgd": rim_lit, "pvc-sgd": rim_lit, "soap-film": bubble, "water": drops,
    "diamond": cut, "window-glass": window, "frosted-window": window, "leaf": leaf,
    "paper-lamp": lantern, "lamp": shaded,
    "chalk": back_lit, "ceramic": back_lit, "porcelain": back_lit, "teflon-abc": back_lit, "pearl": ball,
    "physically-based-water": drops,
    "physically-based-diamond": cut, "physically-based-sapphire": cut, "physically-based-soap-bubble": bubble,
}  # fmt: skip


def surface(document: Document) -> Document:
    """The material of a preset, which may be stored with its textures."""
    if "materials" not in document:
        return document
    (material,) = document["materials"].values()
    return dict(material)


def chosen(name: str, material: Document) -> Callable[[], Document]:
    """By name, else by what light does in it."""
    if name in SHOWN:
        return SHOWN[name]
    if material.get("transmission", 0) == 1:
        return clear
    if material.get("subsurface", 0) and "subsurface_radius" in material:
        return back_lit
    color = material.get("base_color", material.get("albedo", 0.5))
    if isinstance(color, list) and max(color) < 0.06 and not material.get("metallic"):
        return rim_lit
    return ball


def shown(name: str, document: Document) -> Document:
    """The scene of a material's picture."""
    material = surface(document)
    scene = chosen(name, material)()
    scene["materials"][SUBJECT] = sized(material)
    if "textures" in document:
        scene["textures"] = {key: closer(name, texture) for key, texture in document["textures"].items()}
    return scene


def closer(name: str, texture: Document) -> Document:
    """A texture as it looks from near by."""
    if name not in NEAR or "scale" not in texture:
        return texture
    return texture | {"scale": [round(NEAR[name] * x, 5) for x in texture["scale"]]}


def sized(material: Document) -> Document:
    """The material of a ball that is small enough to be seen through: in place of the ball the distance is scaled."""
    distance = material.get("attenuation_distance")
    if distance is None:
        return material
    radius = DROP if min(material["attenuation_color"]) ** (DROP / distance) > 0.97 else min(1.0, DEEP * distance)
    return material | {"attenuation_distance": round(distance / radius, 5)}
