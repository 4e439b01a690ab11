"""Family kernels: most pictures of the tests are traced by the kernel of a family of scenes, not by one of their own.

The product compiles in what a scene has and leaves out what it lacks, so that nearly every scene of a test would be
a kernel: seconds of LLVM for milliseconds of tracing. The kernel of a family has the code of `BASE`, which any scene
may need, and of those `GROUPS` of which the scene needs something. It reads from the uniforms how many records there
are, and which estimator and sampler are asked for. Flags change no pixel beyond rounding: tests/gpu/test_families.py
shows it on a few scenes, and `make long-test` runs the same tests with exact kernels (SUNBOX_EXACT=1).
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from gpu import Renderer, RenderSettings, layout, renderer
from gpu.arrays import SceneArrays, TextureArrays
from gpu.device.scene import Scene, material_words
from gpu.device.textures import KINDS, placeholder
from gpu.kernels import features, recipes_glsl, textures_glsl
from gpu.kernels.flag_table import FLAGS
from gpu.layout import texture_records
from gpu.layout.texture_records import SLOT_NUMBER_SHIFT, TextureSlot, TextureUse

EXACT = os.environ.get("SUNBOX_EXACT", "") not in ("", "0")


def _flags(names: str) -> frozenset[str]:
    return frozenset(f"HAS_{name}" for name in names.split())


_BASE = _flags(
    "SPHERES QUADS BOXES EMISSION LIGHTS MANY_LIGHTS POINT_LIGHTS DIRECTIONAL_LIGHTS SPHERE_LIGHTS QUAD_LIGHTS "
    "ENVIRONMENT APERTURE"
)
_ODD = _flags(
    "VAST_SPHERES DISKS CYLINDERS ELLIPSOIDS CYLINDER_LIGHTS ELLIPSOID_LIGHTS SPOT_LIGHTS SUN_DISKS SUN LIGHT_TREE "
    "ENVIRONMENT_IMAGE ENVIRONMENT_CUBE ORTHOGRAPHIC PANORAMA HIDDEN_SHAPES OPACITY EMISSION_BOTH"
)
_MESHES = _flags("TRIANGLES TRIANGLE_LIGHTS BVH BVH_TRIANGLES SINGLE_SIDED SMOOTH_NORMALS LIGHT_TREE")
_COATS = _flags("SUBSURFACE SHEEN ANISOTROPIC CLEARCOAT CONDUCTOR")
_PRINCIPLED = _COATS | _flags("PRINCIPLED PRINCIPLED_LOBES")
_OPENPBR = _COATS | _flags("OPENPBR OPENPBR_LOBES DIFFUSE_ROUGHNESS LAYERED_LIGHTS")
_OLD = _flags("DISNEY METAL_ROUGH BLINN_PHONG PHONG AMBIENT SUBSURFACE SHEEN ANISOTROPIC CLEARCOAT")
_GLASS = _flags("TRANSMISSION MIRRORS ATTENUATION")
_PANES = _flags("THIN_WALLS STRAIGHT")
_TEXTURES = _flags("TEXTURES BYTE_TEXELS FLOAT_TEXELS SRGB_TEXELS CHECKERS UVS VERTEX_COLORS TEXTURED_LIGHTS")
_BUMPS = _TEXTURES | _flags("NORMAL_MAPS HEIGHTS COAT_NORMALS")
_MICROFACETS = frozenset(name for name in FLAGS if name.startswith("HAS_MICROFACET"))
_MEDIA = _flags("MEDIA SCATTERING GLOWING_MEDIA STRAIGHT LIGHT_TREE")
# A scene is of the first of these that has all of its flags. What several have together costs LLVM more than the sum
# of what each adds: layers in a tree of every kind of shape over a minute. Scenes of such things keep kernels with
# their own flags, of 5 to 10 s. `PRIORITIES` is nowhere: it says what a scene means.
FAMILIES: dict[str, frozenset[str]] = {
    "matte": _BASE,
    "odd": _BASE | _ODD,
    "principled": _BASE | _PRINCIPLED,
    "glass": _BASE | _PRINCIPLED | _GLASS,
    "odd glass": _BASE | _ODD | _PRINCIPLED | _GLASS,
    "old models": _BASE | _ODD | _OLD,
    "meshes": _BASE | _MESHES,
    "meshes of glass": _BASE | _MESHES | _PRINCIPLED | _GLASS,
    "odd meshes": _BASE | _ODD | _MESHES,
    "openpbr": _BASE | _OPENPBR | _GLASS,
    "microfacet": _BASE | _MICROFACETS,
    "measured": _BASE | frozenset(name for name in FLAGS if name.startswith("HAS_MEASURED")),
    "textures": _BASE | _TEXTURES,
    "principled textures": _BASE | _TEXTURES | _PRINCIPLED,
    "textured meshes": _BASE | _MESHES | _TEXTURES,
    "odd textures": _BASE | _TEXTURES | _flags("ELLIPSOIDS OPACITY EMISSION_BOTH"),
    "textured models": _BASE | _TEXTURES | _PRINCIPLED | _GLASS | _OLD,
    "textured microfacet": _BASE | _TEXTURES | _MICROFACETS,
    "bumps": _BASE | _BUMPS | _PRINCIPLED,
    "odd bumps": _BASE | _BUMPS | _PRINCIPLED | _GLASS | _flags("ELLIPSOIDS"),
    "bumpy meshes": _BASE | _BUMPS | _MESHES | _flags("TANGENTS"),
    "media": _BASE | _PRINCIPLED | _GLASS | _MEDIA,
    "panes": _BASE | _PRINCIPLED | _GLASS | _PANES,
}
# Records that stand in uniform blocks, from which llvmpipe loads with a third of a storage buffer's code.
_ROOM = {"SPHERE_COUNT": 64, "QUAD_COUNT": 64, "BOX_COUNT": 64, "ELLIPSOID_COUNT": 64, "TRIANGLE_COUNT": 64}
_LIGHTS, _MATERIALS = 64, 16
# Members of materials that have a slot in every textured scene.
_TEXTURED = ("base_color", "roughness")
_TEXTURE_CODE = {"TEXTURE_SURFACE_LOOP": "uniforms.looped_textures", "ANY_CLAMPED": 1, "ANY_MIRRORED": 1}


def family(raised: frozenset[str]) -> frozenset[str]:
    """The flags of the family of scenes that raise these; where there is none, their own, and what costs no more
    outside of trees."""
    alone = raised if "HAS_BVH" in raised else raised | _BASE
    return next((flags for flags in FAMILIES.values() if raised <= flags), alone)


def spread(textures: TextureArrays, raised: frozenset[str]) -> TextureArrays:
    """The same textures, where members have slots of their own: those that are textured often at the same places in
    all scenes, with empty slots where this one does not texture them."""
    has_bumps = not raised.isdisjoint(("HAS_NORMAL_MAPS", "HAS_HEIGHTS"))
    bumps = [*texture_records.NORMALS, texture_records.HEIGHT] if has_bumps else []
    wanted = dict.fromkeys([*_TEXTURED, *bumps, *textures.slots])
    members = sorted(wanted, key=lambda name: name in textures_glsl.APART)  # these come last
    slots, uses = textures_glsl.records(textures)
    empty = np.zeros((len(slots), len(members)), TextureSlot.dtype)
    empty["width"] = empty["height"] = 1
    new_slots, new_uses = empty, np.zeros(empty.shape, TextureUse.dtype)
    size = 4 * recipes_glsl.groups(textures)
    recipes = textures.words[:, textures.words.shape[1] - size * slots.shape[1] :].reshape(*slots.shape, size)
    new_recipes = np.zeros((*empty.shape, size), np.uint32)
    for new, name in enumerate(members):
        if name in textures.slots:
            old = textures.slots[name]
            new_slots[:, new], new_recipes[:, new] = slots[:, old], recipes[:, old]
            new_slots["flags"][:, new] &= (1 << SLOT_NUMBER_SHIFT) - 1
            new_slots["flags"][:, new] |= new << SLOT_NUMBER_SHIFT if size else 0
            new_uses[:, new] = uses[:, list(textures.slots).index(name)]
    parts = [new_slots.view(np.uint32), new_uses.view(np.uint32), new_recipes]
    words = np.concatenate([part.reshape(len(slots), -1) for part in parts], axis=1)
    return replace(textures, slots={name: slot for slot, name in enumerate(members)}, words=words)


class FamilyScene(Scene):
    """A scene whose kernels are those of its family."""

    def _flags(self) -> frozenset[str]:
        return family(super()._flags())

    @property
    def _textures(self) -> TextureArrays | None:
        textures = self.arrays.textures
        return None if textures is None else spread(textures, self._raised)

    def _materials(self) -> np.ndarray:
        spreading = replace(self.arrays, textures=self._textures)
        return material_words(spreading)

    def write_uniforms(self, uniforms: np.ndarray) -> None:
        super().write_uniforms(uniforms)
        textures = self._textures
        if textures is not None:
            uniforms["looped_textures"] = textures_glsl.defines(textures)["TEXTURE_SURFACE_SLOTS"]

    def _upload_details(self) -> None:
        super()._upload_details()
        taken = (each.upload for each in (self._images, self._measured) if each is not None)
        bound = set(self._details).union(*taken)
        # Where the texture of another scene was still bound, llvmpipe would compile the kernel for its kind as well.
        self._details |= {unit: placeholder(self._context, unit) for unit in KINDS.keys() - bound}

    def defines(self, settings: RenderSettings) -> dict[str, object]:
        textures = self._textures
        places = textures_glsl.defines(textures) | ({} if textures is None else _TEXTURE_CODE)
        counts = features.loops_from_uniforms() | _ROOM | places
        counts["LIGHT_COUNT"] = _LIGHTS if len(self.arrays.lights) <= _LIGHTS else 0
        groups = layout.Material.words // 4 + textures_glsl.groups(textures)
        fits = _MATERIALS * 16 * groups <= 16384 and len(self.arrays.materials) <= _MATERIALS
        counts["MATERIAL_COUNT"] = _MATERIALS if fits else 0
        choices = features.choices_from_uniforms() | {"HAS_CLAMP": 1, "SHADE_ONCE": 1}
        return features.defines(self._raised, settings, counts) | choices


class FamilyRenderer(Renderer):
    """A renderer whose pictures are traced by family kernels, except within `exact()`."""

    is_exact = EXACT

    def load(
        self,
        arrays: SceneArrays,
        editing: bool = False,
        everything: bool = False,
        raised: frozenset[str] = frozenset(),
    ) -> Scene:
        if self.is_exact or everything:
            return super().load(arrays, editing, everything, raised)
        self._use_context()
        renderer._check(arrays)
        return FamilyScene(self.context, arrays, editing, self._shared, False, raised)

    @contextmanager
    def exact(self, exact: bool = True) -> Iterator[None]:
        """A time in which scenes get the kernels that the product gives them, or those of families."""
        before, self.is_exact = self.is_exact, exact
        try:
            yield
        finally:
            self.is_exact = before
