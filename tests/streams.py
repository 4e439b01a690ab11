"""What frames of a stream are looked at by."""

from __future__ import annotations

from typing import Any

from tests.serving import Picture

RAW = {"format": "rgba32f"}


def pictures(heard: list[Any]) -> list[Picture]:
    return [message for message in heard if isinstance(message, Picture)]


def rises(frames: list[Picture]) -> bool:
    """Whether generation, then scale, then samples never fall, and the numbers are consecutive."""
    keys = [(frame.generation, frame.scale, frame.samples) for frame in frames]
    numbers = [frame.seq for frame in frames]
    return keys == sorted(keys) and numbers == list(range(numbers[0], numbers[0] + len(numbers)))
