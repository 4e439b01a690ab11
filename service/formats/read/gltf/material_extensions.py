"""The KHR_materials_* extensions of the metallic-roughness model, as parameters of `principled`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from service.document.numbers import LARGEST
from service.formats.read.gltf import anisotropy_texture, iridescence
from service.formats.read.gltf.json_view import JsonView
from service.formats.read.gltf.textures import factor

if TYPE_CHECKING:
    from service.formats.read.gltf.material_reader import MaterialReader

DEFAULT_IOR, LARGEST_IOR = 1.5, 4.0
SHOWN_ABBE, LEAST_ABBE = 20.0, 1e-9  # the Abbe number of a dispersion of 1; the least that is read


def add(read: MaterialReader, document: dict[str, Any]) -> None:
    ior = _ior(read)
    transmission = read.place.extension("KHR_materials_transmission")
    through = transmission.number("transmissionFactor", 0, 0, 1) if transmission else 0.0
    clear = transmission is not None and through > 0
    if "KHR_materials_ior" in (read.place.value.get("extensions") or {}) or ior != DEFAULT_IOR:
        document["ior"] = ior
    _specular(read, document, ior, clear)
    _sheen(read, document)
    _anisotropy(read, document)
    _clearcoat(read, document)
    if transmission is not None and clear:
        document["transmission"] = read.scalar(transmission, "transmissionTexture", through, "r")
        _volume(read, document)
    _diffuse_transmission(read, document)
    iridescence.add(read, document)


def normal_map(read: MaterialReader, owner: JsonView, name: str, parameter: str) -> dict[str, Any]:
    info = owner.object(name)
    if info is None:
        return {}
    if read.textures.channels(info) == "L":
        read.notes.add(info.pointer, "a grey image is not a normal map; it is left out")
        return {}
    texture = read.textures.use(info, "linear", read.charts)
    if texture is None:
        return {}
    scale = info.number("scale", 1, -1e6, 1e6)
    if scale < 0:
        read.notes.add(info.at("scale"), "a negative scale is not supported; the normal map is left out")
        return {}
    return {parameter: {"texture": texture} | ({"scale": scale} if scale != 1 else {})}


def _ior(read: MaterialReader) -> float:
    extension = read.place.extension("KHR_materials_ior")
    ior = extension.number("ior", DEFAULT_IOR, 0) if extension else DEFAULT_IOR
    if extension and not 1 <= ior <= LARGEST_IOR:
        nearest = 1.0 if 0 < ior < 1 else LARGEST_IOR  # 0 asks for full reflection
        read.notes.add(extension.at("ior"), f"an ior of {ior:g} is not supported; {nearest:g} is used instead")
        return nearest
    return ior


def _specular(read: MaterialReader, document: dict[str, Any], ior: float, clear: bool) -> None:
    """Turn the reflectance head-on, F0 = ((ior - 1) / (ior + 1))^2 weight colour, into an index and a tint."""
    extension = read.place.extension("KHR_materials_specular")
    if extension is None:
        return
    weight = extension.number("specularFactor", 1, 0, 1)
    color = extension.color("specularColorFactor", (1.0, 1.0, 1.0))
    strength = max(*color, 1.0)  # a colour within 0..1 is principled's own; a brighter one needs a higher index
    tint = tuple(value / strength for value in color)
    document["specular_color"] = read.color(extension, "specularColorTexture", tint)
    if document["specular_color"] == 1:
        del document["specular_color"]
    textured = "specularTexture" in extension
    share = weight * strength
    if share == 1 and not textured:
        return
    if clear:
        read.notes.add(
            extension.at("specularFactor"),
            "specularFactor is not supported beside transmission; the ior alone sets the reflection",
        )
        return
    f0 = ((ior - 1) / (ior + 1)) ** 2 * share
    if 0 < weight < 1 or textured:
        read.notes.add(
            extension.at("specularFactor"),
            "specularFactor lowers the reflection seen head-on only; at grazing angles it stays as it is",
        )
    document.pop("ior", None)
    if textured:
        if f0 > 0.08:
            read.notes.add(
                extension.at("specularFactor"),
                f"a reflectance (F0) of {f0:.3g} under a texture is not supported; 0.08 is used instead",
            )
        document["specular"] = read.scalar(extension, "specularTexture", min(f0 / 0.08, 1.0), "a")
        return
    root = math.sqrt(min(f0, 1.0))
    eta = (1 + root) / (1 - root) if root < 0.6 else LARGEST_IOR
    if eta >= LARGEST_IOR:
        read.notes.add(
            extension.at("specularColorFactor"),
            f"a reflectance (F0) of {f0:.3g} is not supported; 0.36, an ior of 4, is used instead",
        )
    document["ior"] = min(max(eta, 1.0), LARGEST_IOR)


def _sheen(read: MaterialReader, document: dict[str, Any]) -> None:
    extension = read.place.extension("KHR_materials_sheen")
    if extension is None:
        return
    color = read.share(extension, "sheenColorFactor", (0.0, 0.0, 0.0))
    if not max(color):
        return
    document["sheen"] = 1.0
    document["sheen_color"] = read.color(extension, "sheenColorTexture", color)
    roughness = extension.number("sheenRoughnessFactor", 0, 0, 1)
    document["sheen_roughness"] = read.scalar(extension, "sheenRoughnessTexture", roughness, "a")


def _anisotropy(read: MaterialReader, document: dict[str, Any]) -> None:
    """glTF stretches along the tangent only: alpha_t = mix(r^2, 1, strength^2), alpha_b = r^2; ours both ways."""
    extension = read.place.extension("KHR_materials_anisotropy")
    strength = extension.number("anisotropyStrength", 0, 0, 1) if extension else 0.0
    if extension is None or not strength:
        return
    if not read.directed:
        read.notes.add(
            extension.pointer, "anisotropy needs TEXCOORD_0 or TANGENT; it is left out on a mesh that has neither"
        )
        return
    turn, info = extension.number("anisotropyRotation", 0, -1e6, 1e6), extension.object("anisotropyTexture")
    rotation = anisotropy_texture.rotation(
        read.textures, info, read.texture(extension, "anisotropyTexture", "linear"), turn
    )
    if rotation:
        document["anisotropic_rotation"] = rotation
    if isinstance(rotation, dict):
        where = extension.at("anisotropyTexture")
        read.notes.add(
            where,
            "the directions are converted to angles; where these wrap around, a line one texel wide may be wrong",
        )
    roughness = document["roughness"]
    if "anisotropyTexture" in extension or isinstance(roughness, dict):
        read.notes.add(
            extension.pointer, "under a texture, anisotropy stretches the highlight in both directions instead of one"
        )
        document["anisotropic"] = read.scalar(extension, "anisotropyTexture", strength * strength, "b")
        return
    along = roughness**2 + (1 - roughness**2) * strength**2
    across = max(roughness**2, 1e-4)
    document["anisotropic"] = min((1 - across / along) / 0.9, 1.0)
    document["roughness"] = min((along * across) ** 0.25, 1.0)


def _clearcoat(read: MaterialReader, document: dict[str, Any]) -> None:
    extension = read.place.extension("KHR_materials_clearcoat")
    weight = extension.number("clearcoatFactor", 0, 0, 1) if extension else 0.0
    if extension is None or not weight:
        return
    document["clearcoat"] = read.scalar(extension, "clearcoatTexture", weight, "r")
    roughness = extension.number("clearcoatRoughnessFactor", 0, 0, 1)
    document["clearcoat_roughness"] = read.scalar(extension, "clearcoatRoughnessTexture", roughness, "g")
    document.update(normal_map(read, extension, "clearcoatNormalTexture", "clearcoat_normal_map"))


def _volume(read: MaterialReader, document: dict[str, Any]) -> None:
    volume = _thick(read)
    if volume is None:
        document["thin_walled"] = True
        return
    dispersion = read.place.extension("KHR_materials_dispersion")
    if dispersion and (share := dispersion.number("dispersion", 0, 0)) > 0:
        document["abbe"] = min(max(SHOWN_ABBE / share, LEAST_ABBE), LARGEST)
    if "thicknessTexture" in volume:
        read.notes.add(
            volume.at("thicknessTexture"),
            "the thickness texture is not used; rays go through the geometry itself",
        )
    if "attenuationDistance" in volume:
        document["attenuation_distance"] = volume.number("attenuationDistance", 1, 1e-9, 1e9)
        document["attenuation_color"] = factor(read.share(volume, "attenuationColor", (1.0, 1.0, 1.0)))


def _thick(read: MaterialReader) -> JsonView | None:
    """The extension that makes the material a body; None for thin walls."""
    volume = read.place.extension("KHR_materials_volume")
    return volume if volume is not None and volume.number("thicknessFactor", 0, 0) > 0 else None


def _diffuse_transmission(read: MaterialReader, document: dict[str, Any]) -> None:
    extension = read.place.extension("KHR_materials_diffuse_transmission")
    share = extension.number("diffuseTransmissionFactor", 0, 0, 1) if extension else 0.0
    if extension is None or not share:
        return
    if _thick(read) is not None:
        if "transmission" in document:
            read.notes.add(extension.pointer, "beside a body of glass diffuse transmission is left out")
            return
        read.notes.add(extension.pointer, "light does not travel inside the body; its surfaces are thin walls")
    document["thin_walled"] = True
    document["diffuse_transmission"] = read.scalar(extension, "diffuseTransmissionTexture", share, "a")
    color = extension.color("diffuseTransmissionColorFactor", (1.0, 1.0, 1.0))
    document["diffuse_transmission_color"] = read.color(extension, "diffuseTransmissionColorTexture", color)
