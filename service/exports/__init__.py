"""Scenes and materials as files for other programs.

formats         the formats, a row for each
writing         what a writer is given and gives back
saved_material  a saved material as a scene
losses          what a format has no place for, for whoever exports
principled      materials of every model as `principled`, with what that loses
materialx       MaterialX: materials, with their images beside the file
gltf            glTF 2.0: a scene as a GLB, a material as a .gltf
"""

from __future__ import annotations

from service.exports.formats import FORMATS, Format, format_of_ending, material_format, scene_format
from service.exports.losses import Losses
from service.exports.saved_material import material_scene
from service.exports.writing import Exported, Files, Limits

__all__ = [
    "FORMATS",
    "Exported",
    "Files",
    "Format",
    "Limits",
    "Losses",
    "format_of_ending",
    "material_format",
    "material_scene",
    "scene_format",
]
