"""The description of a flag: the scenes that need its code, and the sliders and menus that raise it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gpu.arrays import SceneArrays

Asks = Callable[[SceneArrays], bool]
ANYWHERE = ("any scene",)  # in place of the names of flags


@dataclass(frozen=True)
class Flag:
    """A flag, and what is known of the sliders and menus that raise it while a scene is edited.

    `asks` says whether a scene needs the flag's code. The members called `..._with` name the flags beside which a
    slider can raise this one, or are ANYWHERE. They differ in how the kernels come to have its code by then.
    """

    name: str
    asks: Asks
    # The code is cheap: the kernels of an edited scene have it from the start.
    raised_with: tuple[str, ...] = ()
    # The code is expensive: a kernel with it is compiled in idle time as soon as the scene is shown. Where several
    # flags are compiled with the same one, there is a kernel for each combination.
    compiled_with: tuple[str, ...] = ()
    # It is expensive and rare: one more kernel has it and none of those above, and no superset kernel has it.
    alone_with: tuple[str, ...] = ()
    # The flag comes with one that is compiled so, where all of these are raised by then.
    follows: tuple[str, ...] = ()
    # Whether a slider can raise it in another way: until its kernel is compiled, the scene's superset kernel has it.
    previewed: Asks = lambda scene: False
    # Kernels that evaluate a material alone have it, as it costs a curve no time that anybody would notice.
    evaluated_with: tuple[str, ...] = ()
    in_general: bool = True  # it is not rare: a kernel with everything has it
    spares: bool = False  # it saves work and changes no picture, so that no edit waits for the compiler to raise it
    of_camera: bool = False  # the camera alone decides
    of_settings: bool = False  # kernels have no code by this name: with a setting it decides on another define


def beside(names: tuple[str, ...], raised: frozenset[str]) -> bool:
    """True if one of these flags is raised, or they stand for any scene."""
    return names == ANYWHERE or not raised.isdisjoint(names)
