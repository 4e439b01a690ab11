"""The materials of a scene as a .mtlx, with their images beside it."""

from __future__ import annotations

import math

from service.document import Scene
from service.document.material import OpenpbrMaterial
from service.document.texture import ColorTexture, NormalTexture
from service.exports.losses import Losses
from service.exports.materialx.graph import Graph, Images, Value, switch, valid
from service.exports.principled import as_principled
from service.exports.writing import Exported, Files, Limits, check_size
from service.formats.surface import MODELS, outputs
from service.formats.surface.outputs import Output, is_used
from service.formats.surface.plain import Default
from service.problems import escaped

HEAD = '<?xml version="1.0"?>\n<materialx version="1.39" colorspace="lin_rec709">\n'


def write_scene(scene: Scene, files: Files, limits: Limits) -> Exported:
    """All materials of a scene. Raises InvalidDocument with pointers from the scene's root, TooLarge."""
    found = write_material(scene, files, limits)
    for i in range(len(scene.shapes)):
        found.losses.add(f"/shapes/{i}", "MaterialX has materials only")
    for name in ("lights", "environment"):
        if getattr(scene, name):
            found.losses.add(f"/{name}", "MaterialX has materials only")
    return found


def write_material(scene: Scene, files: Files, limits: Limits) -> Exported:
    """The materials of a scene without shapes. Raises as `write_scene`."""
    losses, images, texts, taken = Losses(), Images(scene, files), list[str](), set[str]()
    for name in scene.materials:
        valid_name = valid(name, taken)
        taken.add(valid_name)
        texts.append(_written(scene, name, valid_name, images, losses))
    text = (HEAD + "\n".join(texts) + "\n</materialx>\n").encode()
    check_size(len(text) + sum(map(len, images.beside.values())), limits)
    return Exported([text], losses, images.beside)


def _written(scene: Scene, name: str, valid_name: str, images: Images, losses: Losses) -> str:
    """One material as the model that has most of its parameters."""
    pointer = f"/materials/{escaped(name)}"
    material, graph = scene.materials[name], Graph(images, pointer, losses)
    if isinstance(material, OpenpbrMaterial):
        model, inputs = "open_pbr_surface", outputs.open_pbr_surface(material)
    else:
        material = as_principled(material, pointer, losses)
        model, inputs = "standard_surface", outputs.standard_surface(material, graph.tell)
    if is_used(material.emission) and material.emission_sides == "both":
        graph.tell("emission_sides", "the file does not say on which sides a surface shines")
    if material.height is not None:
        graph.tell("height", "heights are not written")
    if valid_name != name:
        losses.add(pointer, f"names in MaterialX have letters, digits and _ only; it is called {valid_name}")
    values = {each: _value(graph, MODELS[model].defaults[each], output) for each, output in inputs.items()}
    lines = [graph.input(each, value, f"NG_{valid_name}") for each, value in values.items() if value is not None]
    shader = [f'  <{model} name="SR_{valid_name}" type="surfaceshader">', *lines, f"  </{model}>"]
    wired = f'<input name="surfaceshader" type="surfaceshader" nodename="SR_{valid_name}" />'
    shader.append(f'  <surfacematerial name="{valid_name}" type="material">{wired}</surfacematerial>')
    text = graph.text(f"NG_{valid_name}")
    return "\n".join([*([text] if text else []), *shader])


def _value(graph: Graph, default: Default, output: Output) -> Value | None:
    """The value of an input in the file; None for a normal map without a node."""
    value, parameter = output
    if isinstance(value, bool):
        return switch(value)
    if isinstance(value, NormalTexture):
        return graph.normal(value, parameter)
    if default is None:
        return graph.tangent(math.degrees(math.atan2(value[1], value[0])))
    if isinstance(value, tuple | ColorTexture):
        return graph.color(value, parameter)
    found = graph.number(value, parameter)
    return graph.converted(found, "color3") if isinstance(default, tuple) else found
