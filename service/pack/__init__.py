"""Scene -> gpu.SceneArrays: the only package that knows both the document's words and the renderer's.

scene               the arrays of a whole scene, from a document and its assets
parameters          camera, materials, the environment's rotation: their edits need no other module here
camera_kinds        a row for each kind of camera
measured            measured reflection, by files
geometry            shapes in world space, as records, triangles and the tree over them
lights              lights with their probabilities, and environments with the tables that draw from them
textures            images -> texels, and the numbers of materials that read them
worn                what is drawn of a scene, by what its shapes wear
textured_emission   the mean emission of textured shapes that shine
cache               parts that are reused after an edit, within a budget; the meshes that an editor has moved
edits               the edit that leads to other arrays, and that of parameters alone
"""

from gpu.layout.pixel_layers import ACCUMULATOR_BYTES, FIRST_HIT_BYTES, VECTOR_BYTES
from service.pack.cache import CacheBudget, PackCache
from service.pack.edits import parameter_edit, scene_edit
from service.pack.geometry.scene_bvh import warm_builder
from service.pack.lights.environment_blur import CUBE_FACES
from service.pack.lights.light_bounds import warm_light_tree
from service.pack.parameters import pack_camera, pack_materials, pack_microfacets
from service.pack.scene import Packed, lone_material, pack, pack_material
from service.pack.worn import places, renamed, worn

# Bytes of a pixel in a checkpoint: all samples, and a block of them, which the last picture may lack.
SAVED_PIXEL_BYTES = 2 * ACCUMULATOR_BYTES
# Bytes of a pixel in the renderer: the same, AOVs, and the denoised picture with a copy of it on its way.
RENDERED_PIXEL_BYTES = SAVED_PIXEL_BYTES + FIRST_HIT_BYTES + 2 * VECTOR_BYTES

__all__ = [
    "CUBE_FACES",
    "RENDERED_PIXEL_BYTES",
    "SAVED_PIXEL_BYTES",
    "CacheBudget",
    "PackCache",
    "Packed",
    "lone_material",
    "pack",
    "pack_camera",
    "pack_material",
    "pack_materials",
    "pack_microfacets",
    "parameter_edit",
    "places",
    "renamed",
    "scene_edit",
    "warm_builder",
    "warm_light_tree",
    "worn",
]
