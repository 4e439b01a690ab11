"""Cycles' side of `peers`: a script for an interpreter that has `bpy`, which is no dependency of ours.

`python peer_cycles.py JOB.json OUT.npz`: finds how fast the scene renders, then renders it once for each of the job's
moments with the samples that fit. The seconds are Cycles' own `render_time`, which it stamps into its EXR: with
neither synchronisation nor the building of trees and importance maps (1 to 16 samples took .16 to 2.44 s). The
sampler, the light tree and roulette are as Blender has them by default; off is what would make the picture another
one: the denoiser, adaptive sampling, the clamp and the blur of caustics.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np

STAMP = re.compile(rb"cycles\.[^\0]*\.render_time\0string\0....([0-9:.]+)", re.DOTALL)
PROBE_S = 0.5  # a rate that was found over less is not known to 2 %: the stamp counts hundredths
OFF = 0.1  # a run farther from its moment is tried again: error falls as 1 / time between the two only about


def main() -> None:
    import bpy  # type: ignore[import-not-found]

    job = json.loads(Path(sys.argv[1]).read_text())
    exr = Path(sys.argv[2]).with_suffix(".exr")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    _build(bpy, job["scene"], np.load(job["arrays"]))
    _settings(bpy.context.scene, job, exr)
    render = Render(bpy, job["seed"], exr)
    samples, seconds = 1, 0.0
    while seconds < PROBE_S:
        samples = 2 * samples if seconds < PROBE_S / 4 else round(1.25 * samples * PROBE_S / seconds)
        seconds = render(samples)
    rate = samples / seconds
    runs = []
    for moment in job["moments"]:
        for _ in range(job["tries"]):
            samples = max(1, round(rate * moment))
            seconds = render(samples)
            rate = samples / seconds
            if abs(seconds / moment - 1) <= OFF:
                break
        runs.append((seconds, samples, render.picture()))
    seconds_at, counts, pictures = zip(*runs, strict=True)
    np.savez(sys.argv[2], seconds=seconds_at, samples=counts, pictures=pictures)


class Render:
    def __init__(self, bpy: Any, seed: int, exr: Path) -> None:
        self._bpy, self._exr = bpy, exr
        bpy.context.scene.cycles.seed = seed

    def __call__(self, samples: int) -> float:
        """The seconds that the samples took to trace, to the hundredth."""
        self._bpy.context.scene.cycles.samples = samples
        self._bpy.ops.render.render(write_still=True)
        stamp = STAMP.search(self._exr.read_bytes())
        assert stamp, "Blender wrote no render_time into its EXR"
        seconds = 0.0
        for part in stamp[1].decode().split(":"):
            seconds = 60 * seconds + float(part)
        return seconds

    def picture(self) -> np.ndarray:
        """What was rendered last: (h, w, 3) float32, linear, row 0 at the top."""
        image = self._bpy.data.images.load(str(self._exr))
        image.colorspace_settings.name = "Non-Color"
        width, height = image.size
        pixels = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
        shape = height, width, image.channels
        self._bpy.data.images.remove(image)
        return pixels.reshape(shape)[::-1, :, :3].copy()


def _settings(scene: Any, job: dict[str, Any], exr: Path) -> None:
    render, cycles, bounces = scene.render, scene.cycles, job["scene"]["bounces"]
    render.engine = "CYCLES"
    render.resolution_x = render.resolution_y = job["scene"]["size"]
    render.resolution_percentage = 100
    render.threads_mode, render.threads = "FIXED", job["threads"]
    render.filepath = str(exr)
    output = render.image_settings
    output.file_format, output.color_mode, output.color_depth, output.exr_codec = "OPEN_EXR", "RGB", "32", "NONE"
    scene.view_settings.view_transform = "Raw"
    cycles.device = "CPU"
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.blur_glossy = 0.0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
    cycles.film_exposure = 1.0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = bounces


def _build(bpy: Any, scene: dict[str, Any], arrays: Any) -> None:
    materials = {name: _material(bpy, name, what) for name, what in scene["materials"].items()}
    for i, name in enumerate(scene["shapes"]):
        mesh = bpy.data.meshes.new(f"shape{i}")
        mesh.from_pydata(arrays[f"vertices{i}"], [], arrays[f"faces{i}"])
        if f"normals{i}" in arrays:
            mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
            mesh.normals_split_custom_set_from_vertices(arrays[f"normals{i}"])
        mesh.materials.append(materials[name])
        _place(bpy, mesh)
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "VERTICAL"
    camera.angle = scene["camera"]["vfov"]
    placed = _place(bpy, camera)
    placed.matrix_world = np.transpose(scene["camera"]["matrix"])  # theirs is a list of columns
    bpy.context.scene.camera = placed
    if "environment" in arrays:
        bpy.context.scene.world = _world(bpy, arrays["environment"])


def _place(bpy: Any, data: Any) -> Any:
    placed = bpy.data.objects.new(data.name, data)
    bpy.context.collection.objects.link(placed)
    return placed


def _world(bpy: Any, sky: np.ndarray) -> Any:
    height, width = sky.shape[:2]
    image = bpy.data.images.new("sky", width, height, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = sky[::-1]
    image.pixels.foreach_set(rgba.ravel())
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    texture = nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    links.new(texture.outputs["Color"], nodes["Background"].inputs["Color"])
    return world


def _material(bpy: Any, name: str, what: dict[str, Any]) -> Any:
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    shader = _shader(nodes, what).outputs[0]
    if "emission" in what:
        shader = _shining(nodes, links, shader, what["emission"])
        material.cycles.emission_sampling = "FRONT"
    links.new(shader, nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def _shader(nodes: Any, what: dict[str, Any]) -> Any:
    color = [*what["color"], 1.0]
    if what["kind"] == "diffuse":
        node = nodes.new("ShaderNodeBsdfDiffuse")
        node.inputs["Color"].default_value = color
    elif what["kind"] == "glass":
        node = nodes.new("ShaderNodeBsdfGlass")
        node.inputs["Color"].default_value = color
        node.inputs["Roughness"].default_value = 0.0
        node.inputs["IOR"].default_value = what["ior"]
    else:
        node = nodes.new("ShaderNodeBsdfPrincipled")
        node.inputs["Base Color"].default_value = color
        node.inputs["Roughness"].default_value = what["roughness"]
        node.inputs["Metallic"].default_value = what["metallic"]
        node.inputs["IOR"].default_value = 1.5
    return node


def _shining(nodes: Any, links: Any, shader: Any, radiance: list[float]) -> Any:
    """The shader with light added on the outward side alone, as ours shines."""
    emission = nodes.new("ShaderNodeEmission")
    emission.inputs["Color"].default_value = [*radiance, 1.0]
    outward = nodes.new("ShaderNodeMath")
    outward.operation = "SUBTRACT"
    outward.inputs[0].default_value = 1.0
    links.new(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], outward.inputs[1])
    links.new(outward.outputs[0], emission.inputs["Strength"])
    both = nodes.new("ShaderNodeAddShader")
    links.new(shader, both.inputs[0])
    links.new(emission.outputs[0], both.inputs[1])
    return both.outputs[0]


if __name__ == "__main__":
    main()
