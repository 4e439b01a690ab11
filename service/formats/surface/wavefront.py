"""The materials of Wavefront's libraries (.mtl), with Exocortex' additions: as `diffuse` where nothing but Kd
scatters, else as `principled`."""

from __future__ import annotations

from service.formats.surface import parts
from service.formats.surface.plain import Default, PlainInputs
from service.formats.surface.trees import constant, quotient

BLACK = (0.0, 0.0, 0.0)
DEFAULTS: dict[str, Default] = {
    "kd": (0.8,) * 3, "ks": BLACK, "ke": BLACK, "tf": BLACK, "d": 1.0, "ni": 1.5, "ns": 0.0, "illum": 2.0, "pr": 1.0,
    "pm": 0.0, "ps": 0.0, "pc": 0.0, "pcr": 0.0, "aniso": 0.0, "anisor": 0.0,
}  # fmt: skip
DEFAULT_IOR, MAX_IOR = 1.5, 4.0
# The illumination models of `illum`: 0 and 1 have no highlight; 3 and 5 are mirrors; 4, 6, 7 and 9 are glass.
WITHOUT_HIGHLIGHT, MIRRORS, GLASS, REFRACTS = (0, 1), (3, 5), (4, 6, 7, 9), (6, 7)
DARK = 0.1  # share of Ks: a mirror whose Kd is darker than that is a metal of colour Ks
PBR = ("pr", "pm", "ps", "pc", "pcr")
MATTE = {"type", "base_color", "metallic", "specular", "roughness"}  # what is set of a material that may be `diffuse`


def wavefront(s: PlainInputs) -> None:
    illum = int(min(max(s.number("illum", 2), 0), 1000))
    is_glass = _is_glass(s, illum)
    is_mirror = not _is_said(s, "pm") and _is_mirror(s, illum)
    if is_mirror:
        s.put("base_color", "ks", s.tree("ks"))
        s.material["metallic"] = 1.0
    else:
        # Of glass with a transmission filter that is the colour, as base_color tints transmitted light.
        color = "tf" if is_glass and max(s.most("tf")) > 0 else "kd"
        s.put("base_color", color, s.tree(color))
        s.put("metallic", "pm", s.tree("pm"))
        _specular(s, illum, is_glass)
    _roughness(s, is_sharp=is_glass or is_mirror)
    _layers(s)
    opacity = s.most("d")[0]
    if is_glass:
        s.material["transmission"] = float(1 - opacity) if opacity < 1 else 1.0
    if s.material.keys() == MATTE and s.material["metallic"] == s.material["specular"] == 0:
        s.material = {"type": "diffuse", "albedo": s.material["base_color"]}
    parts.emission(s, s.tree("ke"), "ke")
    if not is_glass:
        s.put("alpha", "d", s.tree("d"), 1.0)


def _is_said(s: PlainInputs, name: str) -> bool:
    return s.is_given(name) or s.is_textured(name)


def _is_glass(s: PlainInputs, illum: int) -> bool:
    if illum not in GLASS or s.is_textured("d"):
        return False
    if s.most("d")[0] < 1:
        return True
    return illum in REFRACTS and not s.is_given("d") and max(s.most("tf")) > 0


def _is_mirror(s: PlainInputs, illum: int) -> bool:
    if illum not in MIRRORS or s.is_textured("kd") or not s.is_given("ks"):
        return False
    diffuse, shiny = max(s.most("kd")), max(s.most("ks"))
    return bool(shiny > 0 and diffuse <= DARK * shiny)


def _specular(s: PlainInputs, illum: int, is_glass: bool) -> None:
    """Ks as Blender writes it: 0.5 is the reflectance of a dielectric of index Ni, F0 = 2 Ks F(Ni).

    Where only Kd is given nothing shines, and with Pr and its like the dielectric is an ordinary one.
    """
    ior = _ior(s)
    if is_glass:
        s.material |= {"ior": ior, "specular": 0.5}
        return
    color = s.tree("ks")
    is_colored = s.is_given("ks") or s.fixed(color) is None
    is_plastic = s.is_given("ni") or any(_is_said(s, name) for name in PBR)
    strength = float(max(s.most("ks"))) if is_colored else 0.5 if is_plastic else 0.0
    if illum in WITHOUT_HIGHLIGHT or not strength:
        s.material["specular"] = 0.0
        return
    f0 = 2 * strength * ((ior - 1) / (ior + 1)) ** 2
    s.material["specular"] = round(f0 / parts.SPECULAR_F0, 6)
    if f0 > parts.SPECULAR_F0 * (1 + 1e-9):
        root = min(f0, 0.36) ** 0.5
        s.material |= {"specular": 0.5, "ior": min((1 + root) / (1 - root), MAX_IOR)}
    if is_colored:
        s.put("specular_color", "ks", quotient(color, constant(strength)), 1.0)


def _ior(s: PlainInputs) -> float:
    """Ni; an ordinary one where it is 1 or 0, by which exporters say that they have no value."""
    ior = s.number("ni", DEFAULT_IOR)
    if ior > MAX_IOR:
        s.note("ni", f"an index (Ni) of {ior:g} is not supported; {MAX_IOR:g} is used instead")
    return min(ior, MAX_IOR) if ior > 1 else DEFAULT_IOR


def _roughness(s: PlainInputs, is_sharp: bool) -> None:
    """Pr, or the width of a highlight of exponent Ns: alpha^2 = 2 / (Ns + 2) [Walter et al. 2007, section 5.2].

    Glass and mirrors, for which MTL demands ray tracing, are sharp, whatever the exponent of their highlight.
    """
    if _is_said(s, "pr"):
        s.put("roughness", "pr", s.tree("pr"))
        return
    if is_sharp:
        s.material["roughness"] = 0.0
        return
    exponent = s.number("ns", 0.0)
    if exponent < 0:
        s.note("ns", f"an exponent (Ns) of {exponent:g} is not supported; 0 is used instead")
    s.material["roughness"] = float((2 / (max(exponent, 0.0) + 2)) ** 0.25)


def _layers(s: PlainInputs) -> None:
    s.put("sheen", "ps", s.tree("ps"), 0.0)
    parts.coat(s, "pc", "pcr")
    s.put("anisotropic", "aniso", s.tree("aniso"), 0.0)
    if "anisotropic" in s.material:
        turns = s.number("anisor", 0.0) % 1
        s.put("anisotropic_rotation", "anisor", constant(360 * turns), 0.0)
