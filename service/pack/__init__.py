"""Scene -> gpu.SceneArrays: the only room fluent in both vocabularies.

values      camera, materials, the environment's turn: an edit of one of them needs nothing else from here
placing     document -> `placed` (analytic shapes) and `meshes` with their `normals`, in the world, float64
instances   which meshes share their triangles, as `models` with trees of their own, and where each of them stands
records     placed shapes -> records, relative to an origin; `tree` orders those that are many, in `chunks`
geometry    all of that together, with the shapes that shine
sky         environment -> texels and the tables that draw from them
textures    images -> texels, and which number of which material reads which of them
glow        what textured shapes shine with
warnings    about shapes: equal ones become one with a count
lights      how often each light is picked
moved       what of it differs where shapes have moved
scene       the whole; `cache` keeps geometries and skies between edits, and `moves` which meshes these have moved
"""

from service.pack.cache import CacheBudget, PackCache
from service.pack.moved import moved
from service.pack.scene import Packed, pack
from service.pack.textures import repacked
from service.pack.tree import warm as warm_builder
from service.pack.values import pack_camera, pack_materials, pack_turn

__all__ = [
    "CacheBudget",
    "PackCache",
    "Packed",
    "moved",
    "pack",
    "pack_camera",
    "pack_materials",
    "pack_turn",
    "repacked",
    "warm_builder",
]
