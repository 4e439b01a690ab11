"""Parameters of tests that take long."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest

from gpu.settings import ESTIMATORS


def seldom(values: Iterable[Any], rare: Iterable[Any]) -> list[Any]:
    """The values as parameters; `make long-test` alone tries the rare ones, whose neighbours check the same."""
    kept = list(values)
    rare = list(rare)
    unknown = [value for value in rare if value not in kept]
    assert not unknown, unknown
    return [pytest.param(value, marks=[pytest.mark.slow] * (value in rare)) for value in kept]


# For tests of one light or material each: `mis` draws as `bsdf` and `light` do, which `make long-test` tries alone.
BY_ESTIMATOR = seldom(ESTIMATORS, ("bsdf", "light"))
