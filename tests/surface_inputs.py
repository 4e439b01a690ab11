"""Inputs of surface models as a dictionary has them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.formats.surface import MODELS
from service.formats.surface.plain import Default, Given, PlainInputs

GREY = {"texture": "t", "channel": "g", "factor": 0.5}
COLOR = {"texture": "t", "factor": [0.5, 0.25, 0.125]}


class Said(PlainInputs):
    """The inputs of a model, as a dictionary has them; `notes` are the warnings by their inputs."""

    def __init__(self, model: str, said: Mapping[str, Any]) -> None:
        super().__init__(MODELS[model].defaults)
        self.said, self.notes = said, dict[str, str]()
        MODELS[model].read(self)

    def given(self, name: str, default: Default) -> Given | None:
        found = self.said.get(name)
        return tuple(found) if isinstance(found, list) else found

    def is_given(self, name: str) -> bool:
        return name in self.said

    def is_textured(self, name: str) -> bool:
        return isinstance(self.said.get(name), dict)

    def bump(self, name: str) -> dict[str, Any] | None:
        found = self.said.get(name)
        return found if isinstance(found, dict) else None

    def direction(self, name: str) -> tuple[float, float] | None:
        x, y, _ = self.said.get(name, (1.0, 0.0, 0.0))
        return x, y

    def warn(self, name: str, detail: str) -> None:
        self.notes[name] = detail
