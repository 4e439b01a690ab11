"""The parts of a scene that an edit touches, decided from the two documents and nothing else."""

from __future__ import annotations

from dataclasses import dataclass

from service.document import CubemapEnvironment, Scene, SkyEnvironment
from service.document.material import Material, stretches
from service.document.shape import MeshShape
from service.document.texture import ColorTexture, references
from service.pack import places, renamed, worn

BLINDING = 1e6  # a brightness beyond this may lead past what float32 holds, for which packing has an answer


@dataclass(frozen=True)
class SceneDiff:
    """`whole`: the scene must be packed again; else only what is named differs. `may_be_refused`: packing could be
    refused where it was not before, as there are other files or more to store, which nothing has to be drawn with.
    `numbers`: those of the materials in layers."""

    whole: bool = False
    may_be_refused: bool = False
    camera: bool = False
    materials: bool = False
    environment: bool = False
    numbers: bool = False


def scene_diff(old: Scene, new: Scene) -> SceneDiff:
    a, b = worn(old), worn(new)
    other_numbers = places(old, a) != places(new, b)
    if len(a.materials) == len(b.materials):
        b = renamed(b, list(a.materials))  # by which nothing looks different
    beside = _beside(old, a) != _beside(new, b)
    if _skeleton(a) != _skeleton(b):
        may_be_refused = beside or any(part(a) != part(b) for part in (_files, _asked, _number))
        return SceneDiff(whole=True, may_be_refused=may_be_refused)
    return SceneDiff(
        may_be_refused=beside,
        camera=a.camera != b.camera,
        materials=a.materials != b.materials,
        environment=a.environment != b.environment,
        numbers=other_numbers,
    )


def _beside(scene: Scene, drawn: Scene) -> tuple[object, ...]:
    """Parts that are not drawn and could be refused all the same: textures, and what materials ask of these and of
    files."""
    textures = {name: texture for name, texture in scene.textures.items() if name not in drawn.textures}
    asked = [(getattr(m, "asset", None), _looks(m)) for n, m in scene.materials.items() if n not in drawn.materials]
    return textures, [each for each in asked if any(each)]


def _number(scene: Scene) -> int:
    return len(scene.shapes)


def _asked(scene: Scene) -> list[object]:
    """The demands on textures and meshes that these could turn out not to meet."""
    sets = [[getattr(t, name, None) for name in ("uv", "mapping", "space", "input")] for t in scene.textures.values()]
    cut = [(shape.max_edge, shape.transform) for shape in _displaced(scene)]
    return [sets, [_looks(m) for m in scene.materials.values()], [shape.material for shape in scene.shapes], cut]


def _displaced(scene: Scene) -> list[MeshShape]:
    """The meshes that heights move."""
    return [shape for shape in scene.shapes if isinstance(shape, MeshShape) and shape.displacement]


def _skeleton(scene: Scene) -> tuple[object, ...]:
    """The parts that arrays, light tables and kernels are made from: equal skeletons differ in values that are edited
    in place.

    Emission and its sides are part of it: they decide which shapes are lights, and how often each is picked. So is
    which parameter reads which texture, and which file a material has; factors are not. A mesh whose highlight is
    stretched has tangents. An ambient term counts where it is blinding. Heights that move a mesh decide where its
    triangles are.
    """
    displaced = {shape.material for shape in _displaced(scene)}
    on_meshes = {shape.material for shape in scene.shapes if isinstance(shape, MeshShape)}
    materials = [
        (
            name, m.type, getattr(m, "asset", None), m.emission, m.emission_sides, _blinding(m), _looks(m),
            name in on_meshes and stretches(m), m.height if name in displaced else None,
        )
        for name, m in scene.materials.items()
    ]  # fmt: skip
    return materials, scene.textures, scene.shapes, scene.lights, _environment(scene)


def _blinding(material: Material) -> float:
    """The brightness of its ambient term, where it is blinding."""
    ambient = getattr(material, "ambient", (0.0,))
    brightest = max(ambient.factor if isinstance(ambient, ColorTexture) else ambient)
    return brightest if brightest > BLINDING else 0.0


def _looks(material: Material) -> list[object]:
    return [
        (field, r.texture, getattr(r, "channel", None), getattr(r, "shading", None))
        for field, r in references(material).items()
    ]


def _environment(scene: Scene) -> object:
    """The environment but for its turn and its brightness, which counts only as being there, and not blinding."""
    e = scene.environment
    if e is None:
        return None
    scale = e.scale if e.scale > BLINDING else float(e.scale > 0)
    still: dict[str, float] = {"rotation": 0.0, "scale": scale}
    if isinstance(e, SkyEnvironment):
        still["sun_azimuth"] = 0.0  # a turn of the map that the sky was baked into
    return e.model_copy(update=still)


def _files(scene: Scene) -> list[object]:
    e = scene.environment
    one = getattr(e, "asset", None), getattr(e, "layer", None)
    faces = list(e.assets) if isinstance(e, CubemapEnvironment) else [one]
    images = (getattr(texture, "content", None) for texture in scene.textures.values())
    others = (getattr(each, "asset", None) for each in (*scene.shapes, *scene.materials.values()))
    return [*faces, *images, *others]
