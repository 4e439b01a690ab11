"""The edit of a scene's camera, materials or environment's turn, for which nothing else is packed."""

from __future__ import annotations

from gpu import SceneArrays, SceneEdit
from service.document import Scene
from service.pack.measured import keep_measured
from service.pack.microfacets import pack_microfacets
from service.pack.parameters import pack_camera, pack_materials, pack_turn
from service.pack.textures.words import repacked
from service.pack.worn import places, worn


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
