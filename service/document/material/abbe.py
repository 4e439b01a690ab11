"""Dispersion by the Abbe number, (n_d - 1) / (n_F - n_C) at 587.56, 486.13 and 656.27 nm."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from service.document.numbers import LARGEST

MOST = 1e30  # of its inverse, which single precision holds; an index far less dispersed reaches its bounds

Abbe = Annotated[float, Field(gt=0, le=LARGEST)]


def dispersion(abbe: float | None, share: float = 1.0) -> float:
    """The share of the inverse Abbe number; 0 without any."""
    return 0.0 if abbe is None else share / max(abbe, 1 / MOST)
