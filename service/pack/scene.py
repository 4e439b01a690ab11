"""The whole scene, from its parts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np

from gpu import EnvironmentArrays, SceneArrays
from gpu.layout import LEAF_FIRST_MASK, LightKind, ShapeKind
from service.assets import Assets
from service.pack.edits.cache import PackCache, content, lasting
from service.pack.geometry.assemble import Geometry, assemble
from service.pack.geometry.shared_meshes import shift
from service.pack.geometry.world import triangles
from service.pack.lights import lights
from service.pack.lights.environment import PackedEnvironment, environment_key, pack_environment
from service.pack.lights.light_bounds import Grown, grow_light_tree
from service.pack.parameters import pack_camera, pack_materials, pack_turn
from service.pack.textured_emission import dark, mean_emission
from service.pack.textures.uses import required_charts
from service.pack.textures.words import pack_textures
from service.scene import Camera, Material, Scene
from service.scene.environment import Environment
from service.scene.numbers import BRIGHTEST
from service.scene.shape import MeshShape

_NOWHERE = Camera(position=(0.0, 0.0, 1.0), target=(0.0, 0.0, 0.0))
MAX_TRIANGLES = LEAF_FIRST_MASK + 1


class Limits(Protocol):
    @property
    def max_triangles(self) -> int: ...

    @property
    def max_texels(self) -> int: ...


@dataclass(frozen=True)
class Packed:
    """Arrays that share memory with the cache's: not to be written to."""

    arrays: SceneArrays
    warnings: list[str]


def pack(scene: Scene, assets: Assets, cache: PackCache | None = None, limits: Limits | None = None) -> Packed:
    """The renderer's arrays for `scene`.

    Raises InvalidDocument, its pointers from the scene's root. Slow where there is geometry: not for an event loop.
    """
    materials = pack_materials(scene)
    textures, uses, texels, told = pack_textures(scene, assets, cache, limits)
    emissive = np.any(materials["emission"] > 0, axis=1)
    emissive[dark(uses, texels)] = False
    built = _geometry(scene, emissive, assets, cache, limits)
    warnings = [*built.warnings, *told]
    environment, sky_power, peak = None, 0.0, 0.0
    if scene.environment is not None:
        sky = _sky(scene.environment, assets, cache)
        rotation, scale = pack_turn(scene.environment)
        warnings += sky.warnings
        if scale * sky.peak > BRIGHTEST:
            scale = BRIGHTEST / sky.peak
            warnings.append(f"/environment/scale: lowered to {scale:.3g}, as radiance ends at {BRIGHTEST:g}")
        environment = EnvironmentArrays(
            sky.texels, sky.probability, sky.cells, rotation, scale, scene.environment.background,
            sky.cube, sky.sun, sky.sun_share,
        )  # fmt: skip
        if scale > 0:  # what it sends through a disk around the scene
            sky_power, peak = math.pi * built.radius**2 * sky.irradiance, scale * sky.peak
    standing, standing_power = lights.analytic_lights(scene.lights, built.origin, built.radius)
    emission, brightest = mean_emission(materials, uses, texels, built)
    built_sides = lights.sides(built.lights, materials)
    area_power = np.pi * built.areas * lights.luminance(emission) * built_sides

    def grow(near: np.ndarray, power: np.ndarray, share: float) -> Grown | None:
        sides = np.concatenate([built_sides, np.ones(len(near) - len(built_sides), built_sides.dtype)])
        return grow_light_tree(near, power, share, built.shapes, sides, 2 * built.radius, cache)

    weighed, light_tree = lights.weigh(
        np.concatenate([built.lights, standing]), np.concatenate([area_power, standing_power]), sky_power, grow
    )
    reached = np.where(standing["kind"] == LightKind.DIRECTIONAL, 1.0, math.pi * built.radius**2)
    peak = max(
        peak,
        brightest,
        float((standing["intensity"].max(axis=1, initial=0.0) / reached).max(initial=0.0)),
    )
    arrays = SceneArrays(
        camera=pack_camera(scene.camera, built.origin),
        materials=materials,
        spheres=built.shapes[ShapeKind.SPHERE],
        quads=built.shapes[ShapeKind.QUAD],
        boxes=built.shapes[ShapeKind.BOX],
        ellipsoids=built.shapes[ShapeKind.ELLIPSOID],
        triangles=built.shapes[ShapeKind.TRIANGLE],
        triangle_normals=built.triangle_normals,
        tangents=built.tangents,
        triangle_uvs=built.triangle_uvs,
        triangle_uvs_1=built.triangle_uvs_1,
        triangle_colors=built.triangle_colors,
        lights=weighed,
        light_tree=light_tree,
        nodes=built.nodes,
        node_count=built.node_count,
        node_origin=built.node_origin,
        node_scale=built.node_scale,
        instances=built.instances,
        instance_nodes=built.instance_nodes,
        instance_shift=shift(built.models),
        bvh_kinds=built.bvh_kinds,
        large=built.large,
        environment=environment,
        textures=textures,
        radiance_scale=lights.radiance_scale(peak),
        origin=built.origin,
    )
    return Packed(arrays, warnings)


def pack_material(material: Material) -> SceneArrays:
    """A scene that holds this material, which must not read textures, and nothing to look at."""
    scene = Scene(version=1, camera=_NOWHERE, materials={"": material}, shapes=[])
    return SceneArrays(camera=pack_camera(scene.camera), materials=pack_materials(scene))


def _geometry(
    scene: Scene, emissive: np.ndarray, assets: Assets, cache: PackCache | None, limits: Limits | None
) -> Geometry:
    names = list(scene.materials)
    used = {shape.material for shape in scene.shapes}
    shining = frozenset(name for name, shines in zip(names, emissive, strict=True) if shines and name in used)
    room = MAX_TRIANGLES if limits is None else min(limits.max_triangles, MAX_TRIANGLES)
    read = required_charts(scene)
    if cache is None or not all(lasting(getattr(shape, "asset", None)) for shape in scene.shapes):
        return assemble(scene.shapes, names, shining, assets, room, read)
    contents = tuple(map(content, scene.shapes))
    apart = cache.moves.apart(scene.shapes, contents, lambda shape: triangles(shape, assets))
    shared = tuple(names), room, tuple(read.items()), apart
    meshes = [(i, shape) for i, shape in enumerate(scene.shapes) if isinstance(shape, MeshShape)]
    mesh_key = None
    if meshes and not any(shape.material in shining for _, shape in meshes):
        mesh_key = (tuple((i, contents[i]) for i, _ in meshes), *shared)

    def make() -> Geometry:
        kept = cache.gather(Geometry)
        return assemble(scene.shapes, names, shining, assets, room, read, mesh_key, contents, kept, apart)

    return cache.get(("geometry", contents, shining, *shared), make)


def _sky(environment: Environment, assets: Assets, cache: PackCache | None) -> PackedEnvironment:
    key = environment_key(environment)
    make = partial(pack_environment, environment, assets)
    return make() if cache is None or key is None else cache.get(key, make)
