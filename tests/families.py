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

from gpu import Renderer, RenderSettings, layout, renderer
from gpu.arrays import SceneArrays
from gpu.device.scene import Scene
from gpu.device.textures import KINDS, placeholder
from gpu.kernels import features, textures_glsl
from gpu.kernels.flag_table import FLAGS

EXACT = os.environ.get("SUNBOX_EXACT", "") not in ("", "0")


def _flags(names: str) -> frozenset[str]:
    return frozenset(f"HAS_{name}" for name in names.split())


# Code that costs a kernel little.
BASE = _flags(
    "SPHERES QUADS BOXES EMISSION LIGHTS MANY_LIGHTS POINT_LIGHTS DIRECTIONAL_LIGHTS SPHERE_LIGHTS QUAD_LIGHTS "
    "ENVIRONMENT APERTURE"
)
_COATS = _flags("SUBSURFACE SHEEN ANISOTROPIC CLEARCOAT")
# A family has all of a group or nothing of it. Each costs a kernel 1 to 5 s of LLVM, all together many times that.
GROUPS: dict[str, frozenset[str]] = {
    "round shapes": _flags("VAST_SPHERES DISKS CYLINDERS ELLIPSOIDS CYLINDER_LIGHTS ELLIPSOID_LIGHTS"),
    "skies": _flags("SPOT_LIGHTS SUN_DISKS SUN ENVIRONMENT_IMAGE ENVIRONMENT_CUBE ORTHOGRAPHIC PANORAMA"),
    "layers": _flags("HIDDEN_SHAPES OPACITY EMISSION_BOTH"),
    "meshes": _flags("TRIANGLES TRIANGLE_LIGHTS BVH BVH_TRIANGLES SINGLE_SIDED SMOOTH_NORMALS LIGHT_TREE"),
    "many shapes": _flags("BVH_SPHERES BVH_QUADS BVH_BOXES BVH_ELLIPSOIDS"),
    "old models": _flags("DISNEY METAL_ROUGH BLINN_PHONG PHONG AMBIENT") | _COATS,
    "principled": _flags("PRINCIPLED PRINCIPLED_LOBES"),
    "openpbr": _flags("OPENPBR OPENPBR_LOBES DIFFUSE_ROUGHNESS LAYERED_LIGHTS"),
    "coats": _COATS | _flags("CONDUCTOR"),
    "glass": _flags("TRANSMISSION MIRRORS ATTENUATION"),
    "panes": _flags("THIN_WALLS STRAIGHT"),
    "microfacet": frozenset(name for name in FLAGS if name.startswith("HAS_MICROFACET")),
    "measured": frozenset(name for name in FLAGS if name.startswith("HAS_MEASURED")),
    "textures": _flags("TEXTURES BYTE_TEXELS FLOAT_TEXELS SRGB_TEXELS CHECKERS UVS VERTEX_COLORS TEXTURED_LIGHTS"),
    "bumps": _flags("NORMAL_MAPS HEIGHTS"),
    "computed textures": _flags("NOISES SOLID_TEXTURES RAMPS"),
    "media": _flags("MEDIA SCATTERING GLOWING_MEDIA PRIORITIES"),
}
MOST_GROUPS = 4  # a scene of everything has eight: the kernel of its family would take a minute, its own 10 s
# A group is chosen by one of these, where others bring the rest of its flags, too.
_CHOSEN_BY = {
    "old models": _flags("DISNEY METAL_ROUGH BLINN_PHONG PHONG"),
    "openpbr": _flags("OPENPBR"),
}
# Records that stand in uniform blocks, from which llvmpipe loads with a third of a storage buffer's code.
_ROOM = {"SPHERE_COUNT": 64, "QUAD_COUNT": 64, "BOX_COUNT": 64, "ELLIPSOID_COUNT": 64, "TRIANGLE_COUNT": 64}
_LIGHTS, _MATERIALS = 64, 16


def family(raised: frozenset[str]) -> frozenset[str] | None:
    """The flags of the family of scenes that raise these; None where they are of so many groups that a kernel of
    their own is compiled sooner."""
    groups = [group for name, group in GROUPS.items() if not raised.isdisjoint(_CHOSEN_BY.get(name, group))]
    return raised | BASE.union(*groups) if len(groups) <= MOST_GROUPS else None


class FamilyScene(Scene):
    """A scene whose kernels are those of its family."""

    def _flags(self) -> frozenset[str]:
        raised = super()._flags()
        return family(raised) or raised

    def _upload_details(self) -> None:
        super()._upload_details()
        taken = (each.upload for each in (self._images, self._measured) if each is not None)
        bound = set(self._details).union(*taken)
        # Where the texture of another scene was still bound, llvmpipe would compile the kernel for its kind as well.
        self._details |= {unit: placeholder(self._context, unit) for unit in KINDS.keys() - bound}

    def defines(self, settings: RenderSettings) -> dict[str, object]:
        if family(self._raised) is None:
            return super().defines(settings)
        places = textures_glsl.defines(self.arrays.textures)
        counts = features.loops_from_uniforms() | _ROOM | places
        counts["LIGHT_COUNT"] = _LIGHTS if len(self.arrays.lights) <= _LIGHTS else 0
        groups = layout.Material.words // 4 + textures_glsl.groups(self.arrays.textures)
        fits = _MATERIALS * 16 * groups <= 16384 and len(self.arrays.materials) <= _MATERIALS
        counts["MATERIAL_COUNT"] = _MATERIALS if fits else 0
        return features.defines(self._raised, settings, counts) | features.choices_from_uniforms() | {"HAS_CLAMP": 1}


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
        self._own()
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
