"""The page of a report: a table for each part."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tests.bench.device.part import Row

_LONG = 200  # characters of a cell


def page(file: Path) -> str:
    """Markdown: for each part what failed, and tables of its rows, those with the same columns in one."""
    parts: dict[str, list[Row]] = {}
    for line in file.read_text().splitlines():
        row = json.loads(line)
        parts.setdefault(row.pop("part"), []).append(row)
    return "\n".join(_part(name, rows) for name, rows in parts.items())


def _part(name: str, rows: list[Row]) -> str:
    out, columns = [f"## {name}", ""], None
    for row in rows:
        row.pop("at_s", None)
        if "done" in row:
            out += ["", f"{row['took_s']} s of {row['given_s']} s."]
        elif set(row) <= {"failed", "said", "took_s", "given_s"}:
            out += ["", f"**Failed**: {row['failed']}", "", "```", str(row.get("said", "")), "```"]
        else:
            if list(row) != columns:
                columns = list(row)
                out += ["", "| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
            out.append("| " + " | ".join(_cell(value) for value in row.values()) + " |")
    return "\n".join([*out, ""])


def _cell(value: Any) -> str:
    text = f"{value:.4g}" if isinstance(value, float) else str(value)
    return text.replace("\n", " ").replace("|", "/")[:_LONG]
