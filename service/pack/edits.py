"""The edit that leads from one scene to another in which shapes stand at other places, or which another environment
lights: what must be uploaded. And that of a scene's camera, materials or environment's turn alone, for which
nothing else is packed.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any, cast

import numpy as np

from gpu import EnvironmentArrays, MovedArrays, SceneArrays, SceneEdit, TextureArrays
from service.document import Scene
from service.pack.measured import keep_measured
from service.pack.parameters import pack_camera, pack_materials, pack_microfacets, pack_turn
from service.pack.textures.words import repacked
from service.pack.worn import places, worn

MOVED = tuple(MovedArrays.__annotations__)  # the members that may differ
MANY = ("nodes", "light_tree")  # those of them whose length may differ
EDITED = {each.name for each in fields(SceneEdit)}  # members that an edit brings by themselves, in their old length
SMALL = 1 << 20  # bytes up to which the contents of arrays are compared; larger ones must be the same object


def scene_edit(old: SceneArrays, new: SceneArrays) -> SceneEdit | None:
    """The edit that leads from one scene to the other; None where there is none."""
    if len(old.materials) != len(new.materials) or bool(len(old.light_tree)) != bool(len(new.light_tree)):
        return None
    if not len(new.instances) and not _same(old.nodes, new.nodes):  # in which triangles lie, too
        return None
    for name in (field.name for field in fields(SceneArrays)):
        a, b = getattr(old, name), getattr(new, name)
        if name in EDITED or name in MANY:
            continue
        fits = _as_many(a, b) if name in MOVED else _same(a, b)
        if not fits:
            return None
    if not _alike(old.environment, new.environment):
        return None
    lit, moved = new.environment, {n: getattr(new, n) for n in MOVED if not _same(getattr(old, n), getattr(new, n))}
    return SceneEdit(
        camera=new.camera,
        materials=new.materials,
        texture_words=None if new.textures is None else new.textures.words,
        microfacets=new.microfacets if len(new.microfacets) else None,
        environment=None if lit is None else (lit.rotation, lit.scale),
        environment_map=None if _same(old.environment, lit) else lit,
        moved=cast(MovedArrays, moved),
        material_numbers=new.material_numbers,
    )


def _alike(a: EnvironmentArrays | None, b: EnvironmentArrays | None) -> bool:
    """True if kernels read both scenes in the same way."""
    if a is None or b is None:
        return a is b
    kinds = [(e.cube, e.sun is None, e.texels.size > 3) for e in (a, b)]
    return kinds[0] == kinds[1]


def _as_many(a: Any, b: Any) -> bool:
    return not isinstance(a, np.ndarray) or len(a) == len(b)


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a is b or (a.dtype == b.dtype and a.nbytes <= SMALL and np.array_equal(a, b))
    if isinstance(a, EnvironmentArrays) and isinstance(b, EnvironmentArrays):
        still = (field.name for field in fields(a) if field.name not in ("rotation", "scale"))
        return all(_same(getattr(a, name), getattr(b, name)) for name in still)
    if isinstance(a, TextureArrays) and isinstance(b, TextureArrays):
        images = a.key == b.key != "" or (_same(a.texels, b.texels) and _same(a.floats, b.floats))
        return a.slots == b.slots and a.stops == b.stops and a.words.shape == b.words.shape and images
    return type(a) is type(b) and bool(a == b)


def parameter_edit(
    packed: SceneArrays, scene: Scene, camera: bool = False, materials: bool = False, environment: bool = False,
    numbers: bool = False,
) -> SceneEdit:  # fmt: skip
    """The edit of the named parts that leads to `scene`, of which the rest is as it was `packed`. `numbers`: those of
    its materials."""
    whole, scene = scene, worn(scene)
    e, textures = scene.environment, packed.textures
    records = pack_materials(scene) if materials else None
    if records is not None:
        keep_measured(packed.materials, records)
    return SceneEdit(
        camera=pack_camera(scene.camera, packed.origin) if camera else None,
        materials=records,
        texture_words=repacked(textures, scene) if materials and textures else None,
        microfacets=pack_microfacets(scene) if materials and len(packed.microfacets) else None,
        environment=pack_turn(e) if environment and e is not None else None,
        material_numbers=places(whole, scene) if numbers else None,
    )
