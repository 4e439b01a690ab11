"""The types of a document are those of the schema."""

from __future__ import annotations

from typing import Any, get_type_hints

import pytest

from service.document.schema import schema
from sunbox import document

SCHEMA = schema()
MODELS = {**SCHEMA["scene"]["$defs"], "Scene": SCHEMA["scene"], "Settings": SCHEMA["settings"]}


@pytest.mark.parametrize("name", MODELS)
def test_every_model_has_its_members(name: str) -> None:
    model: Any = getattr(document, name)
    assert set(get_type_hints(model)) == set(MODELS[name]["properties"])
    assert set(model.__required_keys__) == set(MODELS[name].get("required", ()))
