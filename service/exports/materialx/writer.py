"""The materials of a scene as a .mtlx, with their images beside it."""

from __future__ import annotations

from service.document import Scene
from service.document.material import OpenpbrMaterial
from service.exports.losses import Losses
from service.exports.materialx.graph import Graph, Images, valid
from service.exports.materialx.models import open_pbr_surface, standard_surface
from service.exports.principled import as_principled
from service.exports.writing import Exported, Files, Limits, check_size
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
        own = valid(name, taken)
        taken.add(own)
        texts.append(_written(scene, name, own, images, losses))
    text = (HEAD + "\n".join(texts) + "\n</materialx>\n").encode()
    check_size(len(text) + sum(map(len, images.beside.values())), limits)
    return Exported([text], losses, images.beside)


def _written(scene: Scene, name: str, own: str, images: Images, losses: Losses) -> str:
    """One material as the model that has most of its parameters."""
    pointer = f"/materials/{escaped(name)}"
    material, graph = scene.materials[name], Graph(images, pointer, losses)
    if isinstance(material, OpenpbrMaterial):
        model, inputs = "open_pbr_surface", open_pbr_surface(material, graph)
    else:
        model, inputs = "standard_surface", standard_surface(as_principled(material, pointer, losses), graph)
    if own != name:
        losses.add(pointer, f"names in MaterialX have letters, digits and _ only; it is called {own}")
    lines = [graph.input(each, value, f"NG_{own}") for each, value in inputs.items()]
    shader = [f'  <{model} name="SR_{own}" type="surfaceshader">', *lines, f"  </{model}>"]
    wired = f'<input name="surfaceshader" type="surfaceshader" nodename="SR_{own}" />'
    shader.append(f'  <surfacematerial name="{own}" type="material">{wired}</surfacematerial>')
    text = graph.text(f"NG_{own}")
    return "\n".join([*([text] if text else []), *shader])
