"""Built-in scenes, materials, environments and stages: JSON documents, and assets that our own code makes for them.

A file's `title` is for menus, its `kind` (of a material) and `group` (of a scene) for their parts, its `source` says
where numbers were measured; none of them is part of the document. A material that shows textures is stored with them,
as users save one. A stage is what things stand on: materials and shapes that it adds to a scene whose thing stands on
the origin. `"builtin:NAME"` in it stands for an asset of `generated`.

physically_based  materials of the Physically Based database
generated      the assets that presets use
mesh           grids, turned curves and rounded boxes, of which the things in scenes are made
tabletop       glasses, a bottle, a candle
upholstery     an armchair, linen
plants         an orange, a tree
metalwork      a watch, the flank of a car
subjects       what materials are shown on: a shader ball, a torus knot, a cyclorama
environments   painted skies, and photographers' studios
computed          scenes that would be long files of numbers: charts of `disney` with their labels, a thousand spheres
encoders          writers of the plainest OpenEXR and PLY files
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from functools import cache, partial
from importlib.resources import files
from typing import Any

from service.document.presets import physically_based
from service.document.presets.computed import parameter_grid, parameter_rows, sphere_field
from service.document.presets.generated import ASSETS, asset, asset_id
from service.problems import NotFound

KINDS = ("scenes", "materials", "environments", "stages")
DEFAULT_SCENE = "shader-ball"
# A material for each kernel that many of the library need, the most useful first.
FAVOURITES = ("gold", "skin", "glass", "ceramic", "car-paint", "matte-clay", "jade", "brushed-aluminium")

# Menus begin with these scenes; others follow by title, and those of the group "Tests" come last.
FIRST_SCENES = (
    DEFAULT_SCENE, "pool", "whisky", "candle", "water-glass", "perfume", "watch", "orange", "car-panel", "armchair",
    "prism", "fog", "cornell-boxes",
)  # fmt: skip
HEADING = ("title", "kind", "group", "source")  # what a file has for lists, beside its document

# Documents that would be long files of numbers.
COMPUTED: dict[tuple[str, str], Callable[[], dict[str, Any]]] = {
    ("scenes", "sphere-field"): sphere_field,
    ("scenes", "disney-parameters"): parameter_rows,
    ("scenes", "disney-grid"): parameter_grid,
}


def names(kind: str) -> list[dict[str, str]]:
    """`[{name, title}]`, of materials with their `kind` and, where numbers were measured, their `source`; of some
    scenes with their `group`.

    By title, after the first scenes; tests and the database's materials come last. Raises NotFound.
    """
    titled = [{"name": name} | _heading(_titled(kind, name)) for name in _known(kind)]
    return sorted(titled, key=partial(_place, kind))


def _place(kind: str, entry: dict[str, str]) -> tuple[bool, int, str]:
    first = (
        FIRST_SCENES.index(entry["name"]) if kind == "scenes" and entry["name"] in FIRST_SCENES else len(FIRST_SCENES)
    )
    return "group" in entry or entry.get("kind") == physically_based.KIND, first, entry["title"]


def _heading(stored: dict[str, Any]) -> dict[str, str]:
    return {key: stored[key] for key in HEADING if key in stored}


def get(kind: str, name: str) -> dict[str, Any]:
    """A document of the caller's own, ready to be rendered or edited. Raises NotFound."""
    if name not in _known(kind):
        raise NotFound(f"there is no preset {name[:80]!r} among the {kind}; there are {', '.join(_known(kind))}")
    document: dict[str, Any] = json.loads(_text(kind, name))
    return document


def likely() -> tuple[dict[str, Any], list[dict[str, Any]], list[dict[str, Any]]]:
    """The documents that a client is likely to look at: the scene with which the editor begins, that scene of other
    materials, and the other scenes but tests."""
    shown = get("scenes", DEFAULT_SCENE)
    edits = [dressed(shown, get("materials", name)) for name in FAVOURITES]
    others = [each["name"] for each in names("scenes") if each["name"] != DEFAULT_SCENE and "group" not in each]
    return shown, edits, [get("scenes", name) for name in others]


def subject(scene: dict[str, Any]) -> str:
    """The material that the eye goes to: that of the first thing which is not flat, which the editor selects."""
    solid = (shape for shape in scene["shapes"] if shape["type"] not in ("quad", "disk"))
    name: str = next(solid, scene["shapes"][0])["material"]
    return name


def dressed(scene: dict[str, Any], material: dict[str, Any]) -> dict[str, Any]:
    """The scene with its subject made of a material of the library, which may be stored with its textures."""
    (bare,) = material["materials"].values() if "materials" in material else [material]
    more = {"textures": scene.get("textures", {}) | material["textures"]} if "textures" in material else {}
    return scene | {"materials": scene["materials"] | {subject(scene): bare}} | more


def default_environment() -> dict[str, Any]:
    """The light of a scene that brings none of its own."""
    return get("environments", "studio")


@cache
def builtin_assets() -> dict[str, bytes]:
    """Bytes by id, `sha256:` and 64 hexadecimal digits: the same on every call and machine."""
    return {asset_id(name): asset(name) for name in ASSETS}


@cache
def _known(kind: str) -> tuple[str, ...]:
    if kind not in KINDS:
        raise NotFound(f"there are no presets of {kind[:80]!r}; there are {', '.join(KINDS)}")
    stored = [entry.name.removesuffix(".json") for entry in files(__name__).joinpath(kind).iterdir()]
    more = list(physically_based.materials()) if kind == "materials" else []
    return tuple(sorted(stored + more + [name for computed, name in COMPUTED if computed == kind]))


@cache
def _titled(kind: str, name: str) -> dict[str, Any]:
    if (kind, name) in COMPUTED:
        return COMPUTED[kind, name]()
    if kind == "materials" and name in physically_based.materials():
        return physically_based.materials()[name]
    document: dict[str, Any] = json.loads(files(__name__).joinpath(kind, f"{name}.json").read_text("utf-8"))
    return document


@cache
def _text(kind: str, name: str) -> str:
    document = {key: value for key, value in _titled(kind, name).items() if key not in HEADING}
    return re.sub(r'"builtin:([a-z-]+)"', lambda match: f'"{asset_id(match[1])}"', json.dumps(document))
