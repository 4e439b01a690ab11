"""Quantities that variables of the environment name, as types of pydantic's fields."""

from __future__ import annotations

import re
from typing import Annotated, Any

from pydantic import BeforeValidator, ByteSize, Field, TypeAdapter, ValidationError


def _size(value: Any) -> Any:
    """The bytes that a size with a unit stands for, as "512 MiB" or "10GB"; anything else as it is."""
    if not isinstance(value, str) or not re.search("[A-Za-z]", value):
        return value
    try:
        return int(_SIZE.validate_python(value))
    except ValidationError:
        raise ValueError(f"{value!r} is no size; write bytes, or a number with a unit, as 512 MiB or 10 GB") from None


_SIZE = TypeAdapter(ByteSize)
Bytes = Annotated[int, BeforeValidator(_size)]
Seconds = Annotated[float, Field(gt=0, allow_inf_nan=False)]
