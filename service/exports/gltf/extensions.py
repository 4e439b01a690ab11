"""The ratified KHR_materials_* extensions, from the parameters of `principled`: the inverse of our importer."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from service.document.material.principled import index_of_specular, roughness_of_gloss
from service.document.texture import ColorTexture, ScalarTexture
from service.exports.gltf.builder import Tree
from service.exports.gltf.material_writer import MaterialWriter
from service.exports.gltf.textures import ALPHA, Plane

WHITE = (1.0, 1.0, 1.0)
FILM_WEIGHT = "thin_film_weight"  # of models whose films cover a part, which glTF has as well
LUMINANCE = (0.3, 0.6, 0.1)  # of the hue that tints, as the model has it
SHOWN_ABBE, LEAST_ABBE = 20.0, 1e-9  # the Abbe number of a dispersion of 1; the least that is read
SPECULAR, SPECULAR_IOR = 0.5, 1.5  # principled's own reflectance head-on, and its index
WRITTEN = {
    "specular", "specular_color", "specular_tint", "ior", "transmission", "abbe", "attenuation_color",
    "attenuation_distance", "sheen", "sheen_color", "sheen_tint", "sheen_roughness", "clearcoat", "clearcoat_gloss",
    "clearcoat_roughness", "clearcoat_normal_map", "anisotropic", "anisotropic_rotation", "thin_walled",
    "diffuse_transmission", "diffuse_transmission_color", "film_thickness", "film_ior",
}  # fmt: skip


def written(of: MaterialWriter) -> Tree:
    """The members of the material's `extensions`."""
    found: Tree = {}
    if of.material.metallic != 1:  # a metal shows nothing of these
        found |= _specular(of) | _transmission(of) | _diffuse_transmission(of) | _sheen(of)
    return found | _clearcoat(of) | _anisotropy(of) | _iridescence(of)


def _specular(of: MaterialWriter) -> Tree:
    m, found = of.material, Tree()
    specular, color = m.specular, Tree()
    factor, planes = of.color(m.specular_color, "specular_color")
    if isinstance(m.specular_tint, ScalarTexture) or m.specular_tint > 0:
        if isinstance(m.base_color, ColorTexture) or isinstance(m.specular_tint, ScalarTexture):
            of.tell("specular_tint", "a tint by a texture has no place in glTF and is left out")
        else:
            of.tell("specular_tint", "the tint is written as a specular colour")
            tint = _tint(m.base_color, m.specular_tint)
            factor = tuple(a * b for a, b in zip(factor, tint, strict=True))
    if factor != WHITE:
        color["specularColorFactor"] = list(factor)
    if (info := of.textures.info((*planes, None), is_srgb=True)) is not None:
        color["specularColorTexture"] = info
    ior = m.ior
    if isinstance(ior, ScalarTexture):
        of.tell("ior", "a texture of indices has no place in glTF; its factor is written")
        ior = min(max(ior.factor, 1.0), 4.0)
    if ior is None and isinstance(specular, ScalarTexture):
        share, plane = of.scalar(specular, "specular", ALPHA)
        ior = index_of_specular(share)
        if (info := of.textures.info((None, None, None, plane), is_srgb=False)) is not None:
            color["specularTexture"] = info
    elif ior is None and specular != SPECULAR:
        of.tell("specular", "it is written as the index of refraction that it stands for")
        ior = index_of_specular(specular)
    if ior is not None:
        found |= of.builder.extension("KHR_materials_ior", {"ior": ior})
    return found | (of.builder.extension("KHR_materials_specular", color) if color else {})


def _transmission(of: MaterialWriter) -> Tree:
    m = of.material
    factor, plane = of.scalar(m.transmission, "transmission", 0)
    if factor == 0:
        return {}
    found = of.builder.extension("KHR_materials_transmission", _scalar(of, "transmission", factor, plane, 0))
    if m.is_thin:  # without a volume it is that in glTF, too
        return found
    volume: Tree = {"thicknessFactor": of.asked.thickness}
    color, distance = m.attenuation_color, m.attenuation_distance
    if distance is not None:
        for name, value in (("attenuation_color", color), ("attenuation_distance", distance)):
            if isinstance(value, ScalarTexture | ColorTexture):
                of.losses.add(of.at(name), "a texture has no place there in glTF; its factor is written")
        volume["attenuationDistance"] = distance.factor if isinstance(distance, ScalarTexture) else distance
        shade = color.factor if isinstance(color, ColorTexture) else color
        if shade != WHITE:
            volume["attenuationColor"] = [min(each, 1.0) for each in shade]
    if m.abbe is not None:
        found |= of.builder.extension(
            "KHR_materials_dispersion", {"dispersion": SHOWN_ABBE / max(m.abbe, LEAST_ABBE)}
        )
    return found | of.builder.extension("KHR_materials_volume", volume)


def _diffuse_transmission(of: MaterialWriter) -> Tree:
    m = of.material
    share, plane = of.scalar(m.diffuse_transmission, "diffuse_transmission", ALPHA)
    if share == 0:
        return {}
    found = _scalar(of, "diffuseTransmission", share, plane, ALPHA)
    field = "base_color" if m.diffuse_transmission_color is None else "diffuse_transmission_color"
    factor, planes = of.color(getattr(m, field), field)
    if factor != WHITE:
        found["diffuseTransmissionColorFactor"] = list(factor)
    if (info := of.textures.info((*planes, None), is_srgb=True)) is not None:
        found["diffuseTransmissionColorTexture"] = info
    return of.builder.extension("KHR_materials_diffuse_transmission", found)


def _sheen(of: MaterialWriter) -> Tree:
    m = of.material
    amount, plane = of.scalar(m.sheen, "sheen", 0)
    if amount == 0:
        return {}
    if plane is not None:
        of.tell("sheen", "a texture of the sheen's amount has no place in glTF; its factor is written")
    color = m.sheen_color
    if color is None:
        color = WHITE
        if isinstance(m.sheen_tint, ScalarTexture) or m.sheen_tint > 0:
            is_known = not isinstance(m.sheen_tint, ScalarTexture) and not isinstance(m.base_color, ColorTexture)
            how = "the tint is written as a sheen colour" if is_known else "a tint by a texture is left out"
            of.tell("sheen_tint", how)
            color = _tint(m.base_color, m.sheen_tint) if is_known else WHITE
    factor, planes = of.color(color, "sheen_color")
    product = [min(amount * each, 1.0) for each in factor]
    if any(np.float32(amount) * np.float32(a) != np.float32(b) for a, b in zip(factor, product, strict=True)):
        of.tell("sheen", "the amount is written into the sheen's colour, which rounds it")
    rough, plane = of.scalar(m.sheen_roughness, "sheen_roughness", ALPHA)
    sheen: Tree = {"sheenColorFactor": product, "sheenRoughnessFactor": rough}
    if (info := of.textures.info((*planes, None), is_srgb=True)) is not None:
        sheen["sheenColorTexture"] = info
    if (info := of.textures.info((None, None, None, plane), is_srgb=False)) is not None:
        sheen["sheenRoughnessTexture"] = info
    return of.builder.extension("KHR_materials_sheen", sheen)


def _clearcoat(of: MaterialWriter) -> Tree:
    m = of.material
    factor, plane = of.scalar(m.clearcoat, "clearcoat", 0)
    if factor == 0:
        return {}
    coat = _scalar(of, "clearcoat", factor, plane, 0)
    rough = m.clearcoat_roughness
    if rough is None:
        gloss = m.clearcoat_gloss
        if isinstance(gloss, ScalarTexture):
            how, gloss = "a texture of the coat's gloss has no place in glTF; its factor is written", gloss.factor
        else:
            how = "the coat's gloss is written as the roughness that it stands for"
        of.tell("clearcoat_gloss", how)
        rough = roughness_of_gloss(min(gloss, 1.0))
    share, plane = of.scalar(rough, "clearcoat_roughness", 1)
    coat |= _scalar(of, "clearcoatRoughness", share, plane, 1)
    if (normal := of.normal(m.clearcoat_normal_map, "clearcoat_normal_map")) is not None:
        coat["clearcoatNormalTexture"] = normal
    return of.builder.extension("KHR_materials_clearcoat", coat)


def _anisotropy(of: MaterialWriter) -> Tree:
    """Ours stretches both ways, alpha_t = alpha / aspect and alpha_b = alpha aspect; glTF's along the tangent only,
    alpha_t = mix(r^2, 1, strength^2) and alpha_b = r^2: its roughness is less than ours."""
    m = of.material
    amount, plane = of.scalar(m.anisotropic, "anisotropic", 2)
    if amount == 0:
        return {}
    turn = m.anisotropic_rotation
    if isinstance(turn, ScalarTexture):
        of.tell("anisotropic_rotation", "a texture of directions is left out")
        turn = 0.0
    if plane is not None and m.normal_map is None:  # else glTF asks for tangents in the mesh
        of.tell("anisotropic", "without a normal map its texture has no place in glTF; its factor is written")
        plane = None
    if plane is not None or isinstance(m.roughness, ScalarTexture):
        of.tell("anisotropic", "under a texture, glTF stretches the highlight along the tangent only")
        strength = math.sqrt(amount)
    else:
        aspect = math.sqrt(1 - 0.9 * amount)
        along, across = m.roughness**2 / aspect, m.roughness**2 * aspect
        if along > 1:
            of.tell("anisotropic", "glTF's highlights are not as wide; this one is narrowed")
        strength = math.sqrt(max(min(along, 1.0) - across, 0.0) / (1 - across)) if across < 1 else 0.0
        of.narrowed = math.sqrt(across)
    found: Tree = {"anisotropyStrength": min(strength, 1.0)}
    if turn:
        found["anisotropyRotation"] = math.radians(turn)
    if plane is not None:
        east = (Plane(value=1.0), Plane(value=0.5), plane, None)
        found["anisotropyTexture"] = of.textures.info(east, is_srgb=False)
    return of.builder.extension("KHR_materials_anisotropy", found)


def _iridescence(of: MaterialWriter) -> Tree:
    """The film's thickness is mix(minimum, maximum, texture) in glTF; ours is its maximum times the texture."""
    m, found = of.material, Tree()
    thickness = m.film_thickness
    if isinstance(thickness, ScalarTexture):
        if thickness.factor > 0:
            green = of.textures.plane(thickness, 1, of.at("film_thickness"))
            if (info := of.textures.info((None, green, None, None), is_srgb=False)) is not None:
                found = {"iridescenceThicknessMinimum": 0.0, "iridescenceThicknessTexture": info}
        thickness = thickness.factor
    if thickness == 0:
        return {}
    ior = m.film_ior
    if isinstance(ior, ScalarTexture):
        of.tell("film_ior", "a texture of indices has no place in glTF; its factor is written")
        ior = min(max(ior.factor, 1.0), 4.0)
    factor, plane = of.scalar(getattr(of.given, FILM_WEIGHT, 1.0), FILM_WEIGHT, 0)
    found |= _scalar(of, "iridescence", factor, plane, 0)
    found |= {"iridescenceIor": ior, "iridescenceThicknessMaximum": thickness}
    return of.builder.extension("KHR_materials_iridescence", found)


def _scalar(of: MaterialWriter, name: str, factor: float, plane: Plane | None, channel: int) -> Tree:
    """The members `nameFactor` and `nameTexture` of an extension."""
    planes: Any = tuple(plane if k == channel else None for k in range(4))
    info = of.textures.info(planes, is_srgb=False)
    return {f"{name}Factor": factor} | ({} if info is None else {f"{name}Texture": info})


def _tint(base: Any, share: float) -> tuple[float, float, float]:
    """mix(1, hue, share): the hue is the base colour at a luminance of 1."""
    luminance = sum(a * b for a, b in zip(base, LUMINANCE, strict=True))
    hue = [each / luminance for each in base] if luminance > 0 else WHITE
    r, g, b = (1 + share * (each - 1) for each in hue)
    return r, g, b
