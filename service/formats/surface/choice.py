"""Which of two materials a surface becomes: the one that loses less of it.

A model has a reading for each. A trial of each says what it would lose, without a warning and without an image, and
the one whose losses weigh least is read; of equal ones the first.
"""

from __future__ import annotations

from collections.abc import Callable

from service.formats.surface.inputs import Inputs

Reading = Callable[[Inputs], None]
UNSAID = 0.5  # the weight of an input that only the richer of two surfaces of a material says


def read_best(s: Inputs, *readings: Reading) -> None:
    """Read the inputs as the material that loses least of them."""
    weights = []
    for reading in readings:
        trial = s.trial()
        reading(trial)
        weights.append(trial.lost)
    readings[weights.index(min(weights))](s)


def rich_is_better(lost: float, plain_lost: float, more: int) -> bool:
    """True if the richer of two surfaces that a material has loses less than the plain one, which it says `more`
    inputs than."""
    return lost <= plain_lost + UNSAID * max(more, 0)
