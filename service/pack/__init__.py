"""Scene -> gpu.SceneArrays: the only package that knows both the document's words and the renderer's.

scene               the arrays of a whole scene, from a document and its assets
parameters          camera, materials, the environment's rotation: an edit of one of them needs nothing else from here
microfacets         the terms of `microfacet`, and the tables for those that have no closed form
geometry            shapes in world space, as records, triangles and the tree over them
lights              lights with how often each is picked, and environments with the tables that draw from them
textures            images -> texels, and which number of which material reads which of them
textured_emission   the mean emission of textured shapes that shine
picture_bytes       the bytes that a picture takes
edits               parts that are reused after an edit, and the arrays that differ
"""

from service.pack.edits.cache import CacheBudget, PackCache
from service.pack.edits.scene_delta import scene_delta
from service.pack.geometry.scene_bvh import warm_builder
from service.pack.lights.environment_blur import CUBE_FACES
from service.pack.lights.light_bounds import warm_light_tree
from service.pack.microfacets import pack_microfacets
from service.pack.parameters import pack_camera, pack_materials, pack_turn
from service.pack.picture_bytes import RENDERED_PIXEL_BYTES, SAVED_PIXEL_BYTES
from service.pack.scene import Packed, pack, pack_material
from service.pack.textures.words import repacked

__all__ = [
    "CUBE_FACES",
    "RENDERED_PIXEL_BYTES",
    "SAVED_PIXEL_BYTES",
    "CacheBudget",
    "PackCache",
    "Packed",
    "pack",
    "pack_camera",
    "pack_material",
    "pack_materials",
    "pack_microfacets",
    "pack_turn",
    "repacked",
    "scene_delta",
    "warm_builder",
    "warm_light_tree",
]
