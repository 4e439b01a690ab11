"""Where a glTF file says the inputs of `gltf_pbr`: in its own model and the KHR_materials_* extensions."""

from __future__ import annotations

import math
from dataclasses import dataclass

from service.formats.surface.inputs import LEAST_LENGTH
from service.formats.types import LARGEST

ROUGH, GLOSSY = "pbrMetallicRoughness", "pbrSpecularGlossiness"


@dataclass(frozen=True)
class Row:
    """Where a file says an input: the extension, the factor with its range, and the texture with its channel; of a
    colour there are all three."""

    extension: str  # "" for the material itself
    factor: str
    texture: str = ""
    channel: str = ""
    low: float = 0.0
    high: float = 1.0


def _row(extension: str, name: str, channel: str = "") -> Row:
    return Row(extension, f"{name}Factor", f"{name}Texture", channel)


ROWS = {
    "metallic": Row(ROUGH, "metallicFactor", "metallicRoughnessTexture", "b"),
    "roughness": Row(ROUGH, "roughnessFactor", "metallicRoughnessTexture", "g"),
    "normal": Row("", "normalTexture"),
    "occlusion": Row("", "", "occlusionTexture"),
    "emissive": Row("", "emissiveFactor", "emissiveTexture"),
    "alpha_mode": Row("", "alphaMode"),
    "alpha_cutoff": Row("", "alphaCutoff", high=math.inf),
    "ior": Row("ior", "ior", high=math.inf),
    "specular": _row("specular", "specular", "a"),
    "specular_color": _row("specular", "specularColor"),
    "sheen_color": _row("sheen", "sheenColor"),
    "sheen_roughness": _row("sheen", "sheenRoughness", "a"),
    "anisotropy_strength": Row("anisotropy", "anisotropyStrength", "anisotropyTexture", "b"),
    "anisotropy_rotation": Row("anisotropy", "anisotropyRotation"),
    "clearcoat": _row("clearcoat", "clearcoat", "r"),
    "clearcoat_roughness": _row("clearcoat", "clearcoatRoughness", "g"),
    "clearcoat_normal": Row("clearcoat", "clearcoatNormalTexture"),
    "transmission": _row("transmission", "transmission", "r"),
    "thickness": Row("volume", "thicknessFactor", high=math.inf),
    "attenuation_distance": Row("volume", "attenuationDistance", low=LEAST_LENGTH, high=LARGEST),
    "attenuation_color": Row("volume", "attenuationColor"),
    "dispersion": Row("dispersion", "dispersion", high=math.inf),
    "diffuse_transmission": _row("diffuse_transmission", "diffuseTransmission", "a"),
    "diffuse_transmission_color": _row("diffuse_transmission", "diffuseTransmissionColor"),
    "iridescence": _row("iridescence", "iridescence", "r"),
    "iridescence_ior": Row("iridescence", "iridescenceIor", high=math.inf),
    "iridescence_thickness": Row(
        "iridescence", "iridescenceThicknessMaximum", "iridescenceThicknessTexture", "g", high=math.inf
    ),
}
