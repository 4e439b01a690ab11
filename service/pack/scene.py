"""A whole scene's arrays, from its parts."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np

from gpu import EnvironmentArrays, SceneArrays, scene_bytes
from gpu.layout import LEAF_FIRST_MASK, LightKind, ShapeKind
from service.document import Material, Scene
from service.document.camera import PerspectiveCamera
from service.document.environment import Environment
from service.document.numbers import BRIGHTEST
from service.document.shape import MeshShape
from service.formats import Assets, ImageData, MeasuredData, MeshData
from service.pack.cache import PackCache, content, lasting
from service.pack.geometry.assemble import Earlier, assemble
from service.pack.geometry.geometry import Geometry
from service.pack.geometry.instances import shift
from service.pack.geometry.shape_records import bodies, odd_media, shape_spaces
from service.pack.geometry.warnings import odd_meshes
from service.pack.geometry.world import ShapeMaterials, triangles
from service.pack.lights import lights
from service.pack.lights.environment import PackedEnvironment, check_images, environment_key, pack_environment
from service.pack.lights.light_bounds import Grown, grow_light_tree
from service.pack.measured import pack_measured
from service.pack.parameters import pack_camera, pack_materials, pack_microfacets, pack_turn
from service.pack.textured_emission import dark, mean_emission
from service.pack.textures.heights import height_fields
from service.pack.textures.uses import required_charts
from service.pack.textures.words import pack_textures
from service.pack.worn import places, worn
from service.problems import AssetError, FieldError, InvalidDocument

_NOWHERE = PerspectiveCamera(position=(0.0, 0.0, 1.0), target=(0.0, 0.0, 0.0))
MAX_TRIANGLES = LEAF_FIRST_MASK + 1


class Limits(Protocol):
    @property
    def max_triangles(self) -> int: ...

    @property
    def max_texels(self) -> int: ...


@dataclass(frozen=True, eq=False)
class Packed:
    """A packed scene. Its arrays share memory with the cache and must not be written to. Equal is only itself: its
    bytes are counted for it as long as it is there."""

    arrays: SceneArrays
    warnings: list[str]

    @property
    def bytes(self) -> int:
        """The bytes that a copy of it takes. Of an environment that other scenes share, the server's copy counts in
        its cache, and so half of it here."""
        environment = self.arrays.environment
        shared = environment.bytes if environment is not None and environment.key else 0
        return scene_bytes(self.arrays) - shared // 2


@dataclass(frozen=True)
class _Sky:
    """The environment, with its power through a disk around the scene (W of luminance, for a brightness of 1) and its
    greatest radiance."""

    arrays: EnvironmentArrays | None = None
    power: float = 0.0
    peak: float = 0.0
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Lights:
    """All lights, the words of the tree by which they are picked, and the greatest radiance that any of them
    causes."""

    records: np.ndarray
    tree: np.ndarray
    peak: float


def pack(
    scene: Scene, assets: Assets, cache: PackCache | None = None, limits: Limits | None = None,
    shared: PackCache | None = None,
) -> Packed:  # fmt: skip
    """The renderer's arrays for what is drawn of `scene`. What is not drawn is checked as well.

    `cache` belongs to a document that is being edited. `shared` caches environments and measured reflection
    of other documents, without the results of edits, which are not requested again.
    Raises InvalidDocument with pointers from the scene's root. Slow with geometry: not for an event loop.
    """
    whole, scene = scene, worn(scene)
    materials = pack_materials(scene)
    measured = pack_measured(whole, scene, assets, materials, cache or shared, limits)
    textures, uses, texels, texture_warnings = pack_textures(whole, scene, assets, cache, limits)
    emissive = np.any(materials["emission"] > 0, axis=1)
    emissive[dark(uses, texels)] = False
    built = _geometry(scene, emissive, assets, cache, limits)
    sky = (
        _Sky() if scene.environment is None else _environment(scene.environment, built.radius, assets, cache, shared)
    )
    emission, brightest = mean_emission(materials, uses, texels, built)
    picked = _lights(scene, built, materials, emission, sky.power, cache)
    arrays = SceneArrays(
        camera=pack_camera(scene.camera, built.origin),
        materials=materials,
        microfacets=pack_microfacets(scene),
        measured=measured.words,
        measured_key=measured.key,
        lights=picked.records,
        light_tree=picked.tree,
        environment=sky.arrays,
        textures=textures,
        spaces=shape_spaces(scene, built.origin),
        bodies=bodies(scene),
        radiance_scale=lights.radiance_scale(max(sky.peak, brightest, picked.peak)),
        material_numbers=places(whole, scene),
    )
    odd = (*odd_meshes(built.meshes.odd, materials, emissive), *odd_media(scene, materials, built.meshes.odd))
    return Packed(
        _with_geometry(arrays, built), [*odd, *built.warnings, *measured.warnings, *texture_warnings, *sky.warnings]
    )


def _environment(
    environment: Environment, radius: float, assets: Assets, cache: PackCache | None, shared: PackCache | None
) -> _Sky:
    sky, key = _packed_environment(environment, assets, cache, shared), environment_key(environment)
    rotation, scale = pack_turn(environment)
    warnings = tuple(sky.warnings)
    if scale * sky.peak > BRIGHTEST:
        scale = BRIGHTEST / sky.peak
        warnings += (f"/environment/scale: lowered to {scale:.3g}, as radiance ends at {BRIGHTEST:g}",)
    arrays = EnvironmentArrays(
        sky.texels, sky.probability, sky.cells, rotation, scale, environment.background,
        sky.cube, sky.sun, sky.sun_share, key="" if key is None else repr(key),
    )  # fmt: skip
    fog = environment.medium
    if scale <= 0 or (fog is not None and min(fog.extinction()) > 0):  # nothing comes through all space
        return _Sky(arrays, warnings=warnings)
    return _Sky(arrays, math.pi * radius**2 * sky.irradiance, scale * sky.peak, warnings)


def _lights(
    scene: Scene, built: Geometry, materials: np.ndarray, emission: np.ndarray, sky_power: float,
    cache: PackCache | None,
) -> _Lights:  # fmt: skip
    """All lights of the scene. `emission` is the mean radiance of each light of `built` (n, 3)."""
    analytic, analytic_power = lights.analytic_lights(scene.lights, built.origin, built.radius)
    built_sides = lights.sides(built.lights, materials)
    area_power = np.pi * built.areas * lights.luminance(emission) * built_sides

    def grow(near: np.ndarray, power: np.ndarray, share: float) -> Grown | None:
        sides = np.concatenate([built_sides, np.ones(len(near) - len(built_sides), built_sides.dtype)])
        return grow_light_tree(near, power, share, built.shapes, sides, 2 * built.radius, cache)

    records, tree = lights.weigh(
        np.concatenate([built.lights, analytic]), np.concatenate([area_power, analytic_power]), sky_power, grow
    )
    reached = np.where(analytic["kind"] == LightKind.DIRECTIONAL, 1.0, math.pi * built.radius**2)
    return _Lights(records, tree, float((analytic["intensity"].max(axis=1, initial=0.0) / reached).max(initial=0.0)))


def _with_geometry(arrays: SceneArrays, built: Geometry) -> SceneArrays:
    return replace(
        arrays,
        spheres=built.shapes[ShapeKind.SPHERE],
        quads=built.shapes[ShapeKind.QUAD],
        boxes=built.shapes[ShapeKind.BOX],
        ellipsoids=built.shapes[ShapeKind.ELLIPSOID],
        triangles=built.shapes[ShapeKind.TRIANGLE],
        triangle_normals=built.triangle_normals,
        # Of what was measured only the file says whether it looks the same from all sides.
        tangents=built.tangents
        and (arrays.textures is not None or bool((arrays.materials["anisotropic"] > 0).any())),
        triangle_uvs=built.triangle_uvs,
        triangle_uvs_1=built.triangle_uvs_1,
        triangle_colors=built.triangle_colors,
        nodes=built.nodes,
        node_count=built.node_count,
        node_origin=built.node_origin,
        node_scale=built.node_scale,
        instances=built.instances,
        instance_nodes=built.instance_nodes,
        instance_shift=shift(built.models),
        bvh_kinds=built.bvh_kinds,
        large=built.large,
        origin=built.origin,
    )


def lone_material(material: Material) -> Scene:
    """A scene with this material and nothing else."""
    return Scene(version=1, camera=_NOWHERE, materials={"": material}, shapes=[])


def pack_material(
    material: Material, assets: Assets | None = None, limits: Limits | None = None, shared: PackCache | None = None
) -> SceneArrays:
    """A scene with this material alone, which must not read textures, and without shapes. Raises InvalidDocument with
    pointers from the material's root, for a file that it refers to."""
    try:
        return pack(lone_material(material), assets or _NoAssets(), limits=limits, shared=shared).arrays
    except InvalidDocument as error:
        raise InvalidDocument(
            FieldError(each.pointer.removeprefix("/materials/"), each.detail) for each in error.errors
        ) from None


class _NoAssets:
    """The assets of a scene without meshes and images."""

    def mesh(self, ref: str) -> MeshData:
        raise AssetError("there are no assets here")

    def image(self, ref: str, layer: str = "") -> ImageData:
        raise AssetError("there are no assets here")

    def measured(self, ref: str) -> MeasuredData:
        raise AssetError("there are no assets here")


def _geometry(
    scene: Scene, emissive: np.ndarray, assets: Assets, cache: PackCache | None, limits: Limits | None
) -> Geometry:
    names = list(scene.materials)
    used = {shape.material for shape in scene.shapes}
    shining = frozenset(name for name, shines in zip(names, emissive, strict=True) if shines and name in used)
    room = MAX_TRIANGLES if limits is None else min(limits.max_triangles, MAX_TRIANGLES)
    materials = ShapeMaterials(names, shining, required_charts(scene), height_fields(scene, assets))
    files = [*scene.shapes, *(height.texture for height in materials.heights.values())]
    if cache is None or not all(lasting(getattr(each, "asset", None)) for each in files):
        return assemble(scene.shapes, materials, assets, room)
    contents = tuple(map(content, scene.shapes))
    apart = cache.moves.apart(scene.shapes, contents, lambda shape: triangles(shape, assets))
    shared = tuple(names), room, tuple(materials.charts.items()), apart
    meshes = [(i, shape) for i, shape in enumerate(scene.shapes) if isinstance(shape, MeshShape)]
    mesh_key = None
    if meshes and not any(shape.material in shining for _, shape in meshes):
        mesh_key = (tuple((i, contents[i]) for i, _ in meshes), *shared)

    def make() -> Geometry:
        earlier = Earlier(cache.gather(Geometry), contents, mesh_key)
        return assemble(scene.shapes, materials, assets, room, earlier, apart)

    return cache.get(("geometry", contents, shining, *shared), make)


def _packed_environment(
    environment: Environment, assets: Assets, cache: PackCache | None, shared: PackCache | None
) -> PackedEnvironment:
    key = environment_key(environment)
    make = partial(pack_environment, environment, assets)
    if key is None:
        return make()
    known: PackedEnvironment | None = shared.find(key) if shared is not None else None
    if known is not None:
        check_images(environment, assets)  # of another document they may have been deleted since
    if cache is not None:
        return cache.get(key, lambda: known or make())
    return known or (make() if shared is None else shared.get(key, make))
