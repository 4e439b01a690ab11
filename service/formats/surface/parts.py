"""Parts that several models have in common, as parameters of `principled`."""

from __future__ import annotations

import numpy as np

from service.formats.surface.inputs import ROUGHLY, Inputs, known
from service.formats.surface.trees import (
    Tree,
    added,
    alike,
    applied,
    clamped,
    complement,
    constant,
    largest,
    less,
    mixed,
    quotient,
    raised,
    times,
)
from service.formats.types import LARGEST

HALF = 0.5  # a film that covers so much is nearer to a whole one than to none
COAT_F0 = 0.04  # reflectance head-on of principled's coat, whose index is 1.5
SPECULAR_F0 = 0.08  # that of principled's `specular` 1
STRETCH = 0.9  # of principled's `anisotropic`: alpha across the tangent is 1 - 0.9 a times that along it
LEAST_ABBE = 1e-9
OCCLUSION = ("occlusion", 1.0, "ambient occlusion is left out: the light that reaches a corner is traced")


def index(f0: Tree) -> Tree:
    """The index of refraction of a reflectance head-on."""
    root = raised(clamped(f0, 0.0, 0.9), 0.5)
    return quotient(added(constant(1.0), root), less(constant(1.0), root))


def reflectance(ior: Tree) -> Tree:
    """The reflectance head-on of an index of refraction."""
    return raised(applied("absval", 1, **{"in": quotient(less(ior, constant(1.0)), added(ior, constant(1.0)))}), 2.0)


def passing(s: Inputs, base: Tree, color: Tree, share: Tree, name: str) -> Tree:
    """The one colour that `principled` has for what it scatters, `base`, and for what passes through: their mix by
    a share, which is told at the input `name` where they differ and both are seen."""
    if s.material.get("metallic") == 1 or alike(base, color):
        return base
    passes, both = known(s, share), (known(s, base), known(s, color))
    is_whole = passes is not None and bool(passes[0] == 1)
    is_same = both[0] is not None and both[1] is not None and bool(np.allclose(*both, atol=1e-6))
    if not is_whole and not is_same:
        s.note(name, "what passes through and what is scattered have one colour here, a mix of both")
    return mixed(base, color, share)


def dielectric(
    s: Inputs, ior: str, strength: Tree | None, weight: str, transmission: str, default: float | None = 1.5
) -> None:
    """The reflection of an index of refraction: what the input `weight` and others multiply it by, `strength`, goes
    into the index, or with a texture into `specular`."""
    if strength is not None and s.is_used(transmission, 0):
        s.note(weight, "beside transmission the index alone sets the reflection")
        strength = None
    if strength is None:
        s.put("ior", ior, s.tree(ior), default)
        return
    f0 = times(reflectance(s.tree(ior)), strength)
    if known(s, strength) is None:
        s.put("specular", weight, times(f0, 1 / SPECULAR_F0))
    else:
        s.put("ior", ior, index(f0), 1.5)


def tint(s: Inputs, name: str) -> Tree:
    """Set the hue of a colour that multiplies all of the reflection; what it takes off the rest: its largest
    channel."""
    color = s.tree(name)
    is_known = s.computes or known(s, color) is not None
    share = largest(color) if is_known else constant(float(max(s.most(name))))
    if not s.is_black(color):
        s.put("specular_color", name, quotient(color, clamped(share, 1e-6, 1e6)), 1.0)
    return share


def stretched(s: Inputs, name: str, ratio: Tree) -> None:
    """Anisotropy, of `ratio`, alpha across the tangent over that along it."""
    s.put("anisotropic", name, quotient(complement(ratio), constant(STRETCH)), instead=s.tree(name))


def sheen(s: Inputs, weight: Tree, color: Tree, roughness: Tree, name: str) -> None:
    if s.is_black(weight):
        return
    s.put("sheen", name, weight, 0.0)
    s.put("sheen_color", name, color)
    s.put("sheen_roughness", name, roughness)


def coat(s: Inputs, weight: str, roughness: str, ior: str | None = None, normal: str | None = None) -> None:
    if not s.is_used(weight, 0):
        return
    share = s.tree(weight)
    if ior is not None and s.is_used(ior, 1.5):
        share = times(share, times(reflectance(s.tree(ior)), 1 / COAT_F0))
        s.note(ior, "the coat's index is 1.5; another one makes it stronger or weaker instead", ROUGHLY)
    s.put("clearcoat", weight, share, 0.0)
    s.put("clearcoat_roughness", roughness, s.tree(roughness))
    if normal is not None:
        s.normal("clearcoat_normal_map", normal)


def film(s: Inputs, thickness: str, ior: str, weight: str | None = None) -> None:
    """A thin film, whose thickness is in nanometres. Ours covers all or nothing."""
    share = [1.0] if weight is None else s.constant(weight)
    if weight is not None and share is None and not s.computes and float(s.most(weight)[0]) < HALF:
        share = [float(s.most(weight)[0])]
    if weight is not None and share is not None and 0 < share[0] < 1:
        how = "it covers all" if share[0] >= HALF else "it is left out"
        s.note(weight, f"a film that covers a part of the surface is not supported; of {share[0]:g} {how}")
    if share is not None and share[0] < HALF:
        return
    tree = s.tree(thickness)
    if weight is not None and share is None:
        s.note(weight, "a film covers all of a texel or nothing here: all where this is 0.5 or more")
        tree = s.masked(thickness, weight)
    if not s.is_black(tree):
        s.put("film_thickness", thickness, tree, 0.0)
    if "film_thickness" in s.material:
        s.put("film_ior", ior, s.tree(ior))


def emission(s: Inputs, light: Tree, name: str, color: Tree | None = None) -> None:
    """`color` is the part of the light that serves where a strength and a colour are textures both."""
    if not s.is_black(light):
        s.put("emission", name, light, instead=color)


def abbe(s: Inputs, number: float) -> None:
    """An Abbe number; 0 is none."""
    if number > 0:
        s.material["abbe"] = min(max(number, LEAST_ABBE), LARGEST)
