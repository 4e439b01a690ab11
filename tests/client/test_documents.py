"""The types of a document are those of the schema."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from typing import Any, get_type_hints

import pytest

from service.document.schema import schema
from sunbox import document

CLIENT = Path(__file__).parents[2] / "client"
SCHEMA = schema()
MODELS = {**SCHEMA["scene"]["$defs"], "Scene": SCHEMA["scene"], "Settings": SCHEMA["settings"]}


def test_document_is_what_the_schema_gives(tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location("generate", CLIENT / "generate.py")
    assert spec and spec.loader
    generate = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generate)
    made = tmp_path / "document.py"
    made.write_text(generate.module(SCHEMA))
    subprocess.run([sys.executable, "-m", "ruff", "format", "--quiet", made], cwd=CLIENT, check=True)
    assert made.read_text() == (CLIENT / "src/sunbox/document.py").read_text(), (
        "run client/generate.py and ruff format"
    )


@pytest.mark.parametrize("name", MODELS)
def test_every_model_has_its_members(name: str) -> None:
    model: Any = getattr(document, name)
    assert set(get_type_hints(model)) == set(MODELS[name]["properties"])
    assert set(model.__required_keys__) == set(MODELS[name].get("required", ()))
