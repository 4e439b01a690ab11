"""The parts of a scene that are drawn: the materials that its shapes wear, and the textures that these read."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from service.document import Scene
from service.document.material import Material
from service.document.procedural import RampInput, RampTexture
from service.document.texture import references


def worn(scene: Scene) -> Scene:
    """The scene without what no shape wears, its materials in the order in which shapes first wear them: a scene with
    another order, or with more in it, has the same kernels, arrays and bits. Without shapes it is as it was."""
    if not scene.shapes:
        return scene
    materials = {shape.material: scene.materials[shape.material] for shape in scene.shapes}
    read = set[str]()
    for material in materials.values():
        read |= set(_read(scene, material))
    textures = {name: texture for name, texture in scene.textures.items() if name in read}
    return scene.model_copy(update={"materials": materials, "textures": textures})


def _read(scene: Scene, material: Material) -> Iterator[str]:
    for reference in references(material).values():
        yield reference.texture
        texture = scene.textures[reference.texture]
        if isinstance(texture, RampTexture) and isinstance(texture.input, RampInput):
            yield texture.input.texture


def renamed(scene: Scene, names: Sequence[str]) -> Scene:
    """The scene with other names for its materials, in their order."""
    if list(scene.materials) == list(names):
        return scene
    of = dict(zip(scene.materials, names, strict=True))
    shapes = [shape.model_copy(update={"material": of[shape.material]}) for shape in scene.shapes]
    materials = {of[name]: material for name, material in scene.materials.items()}
    return scene.model_copy(update={"shapes": shapes, "materials": materials})


def places(scene: Scene, drawn: Scene) -> tuple[int, ...]:
    """The place in `scene` of each material that is `drawn` of it: layers number materials so."""
    order = {name: place for place, name in enumerate(scene.materials)}
    return tuple(order[name] for name in drawn.materials)
