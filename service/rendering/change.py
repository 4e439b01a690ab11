"""What an edit touches, decided from the two documents and nothing else."""

from __future__ import annotations

from dataclasses import dataclass

from service.scene import CubemapEnvironment, Scene, SkyEnvironment

BLINDING = 1e6  # a brightness beyond this may lead past what float32 holds, for which packing has an answer


@dataclass(frozen=True)
class Change:
    """`whole`: the scene must be packed again; else only what is named differs."""

    whole: bool = False
    camera: bool = False
    materials: bool = False
    environment: bool = False


def change(old: Scene, new: Scene) -> Change:
    if _skeleton(old) != _skeleton(new):
        return Change(whole=True)
    return Change(
        camera=old.camera != new.camera,
        materials=old.materials != new.materials,
        environment=old.environment != new.environment,
    )


def risky(old: Scene, new: Scene) -> bool:
    """Whether packing `new` could be refused where `old` was not: other files, or more to hold."""
    return _files(old) != _files(new) or len(old.shapes) != len(new.shapes)


def _skeleton(scene: Scene) -> tuple[object, ...]:
    """What arrays, light tables and kernels are made from: equal skeletons differ in values that are edited in place.

    Emission is part of it: it decides which shapes are lights, and how often each is picked.
    """
    materials = [(name, m.type, m.emission, m.emission_sides) for name, m in scene.materials.items()]
    return materials, scene.shapes, scene.lights, _environment(scene)


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
    faces = list(e.assets) if isinstance(e, CubemapEnvironment) else [getattr(e, "asset", None)]
    return [*faces, *(getattr(shape, "asset", None) for shape in scene.shapes)]
