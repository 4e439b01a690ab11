"""The tasks of docs/api.md, by number and language."""

from __future__ import annotations

import re
from pathlib import Path

PAGE = (Path(__file__).parents[1] / "docs" / "api.md").read_text()
LANGUAGES = ("sh", "python", "js")


def tasks(language: str) -> dict[int, str]:
    """The code of each task; 0 is what all share."""
    sections = re.findall(r"^## (?:(\d+)\. |Before).*?\n(.*?)(?=^## |\Z)", PAGE, re.MULTILINE | re.DOTALL)
    found = {}
    for number, text in sections:
        (code,) = re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
        found[int(number or 0)] = code
    return found
