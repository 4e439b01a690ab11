"""Which of two materials a surface becomes: the one that loses less of it.

A model has a reading for each. A trial of each says what it would lose, without a warning and without an image, and
the one whose losses weigh least is read; of equal ones the first.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy

from service.formats.surface.inputs import Inputs

Reading = Callable[[Inputs], None]
UNSAID = 0.5  # the weight of an input that only the richer of two surfaces of a material says


def read_best(s: Inputs, *readings: Reading) -> None:
    """Read the inputs as the material that loses least of them."""
    weights = []
    for reading in readings:
        trial = copy(s)
        trial.material, trial.losses, trial.is_trial = dict(s.material), {}, True
        reading(trial)
        weights.append(lost(trial))
    readings[weights.index(min(weights))](s)


def lost(s: Inputs) -> float:
    """What all losses of a reading weigh."""
    return sum(s.losses.values())


def rich_is_better(rich: float, plain: float, more: int) -> bool:
    """True if the richer of two surfaces of a material, which says `more` inputs than the plain one, loses less.

    `rich` and `plain` are what their losses weigh."""
    return rich <= plain + UNSAID * max(more, 0)
