"""Materials of the Physically Based database (physicallybased.info, CC0), as presets.

`physically_based.json` is its data, with source, version and licence.
"""

from __future__ import annotations

import json
import math
import re
from functools import cache
from importlib.resources import files
from typing import Any

KIND = "database"  # a part of the library of its own
PREFIX = "physically-based-"
METRE = 100  # cm
TRANSPARENT = 1e-6  # 1/cm; where light goes farther than 10 km nothing is seen of what is absorbed


@cache
def database() -> dict[str, Any]:
    """The file: where its values come from, and `materials`."""
    path = files("service.presets").joinpath("physically_based.json")
    data: dict[str, Any] = json.loads(path.read_text("utf-8"))
    return data


@cache
def materials() -> dict[str, dict[str, Any]]:
    """Presets by name, each with its title and its sources."""
    return {PREFIX + _slug(entry["name"]): _preset(entry) for entry in database()["materials"]}


def _slug(name: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")


def _title(name: str) -> str:
    """The name without brackets, after which the editor cuts titles."""
    return re.sub(r" [(](.*)[)]$", r", \1", name)


def _preset(entry: dict[str, Any]) -> dict[str, Any]:
    sources = "; ".join(dict.fromkeys(reference["title"] for reference in entry["references"]))
    category = ", ".join(entry["category"]).lower()
    return {
        "title": f"{_title(entry['name'])} (Physically Based)",
        "kind": KIND,
        "source": f"Physically Based {database()['version']} (CC0), {category}: {sources}",
        **document(entry),
    }


def document(entry: dict[str, Any]) -> dict[str, Any]:
    """The `principled` material of an entry. Reflectances above 1, which some metals have in a channel, are 1."""
    out: dict[str, Any] = {
        "type": "principled",
        "base_color": [min(1.0, channel) for channel in entry["color"]],
        "roughness": entry["roughness"],
    }
    if entry["metalness"]:
        return out | {"metallic": entry["metalness"]}
    if "ior" in entry:
        out["ior"] = entry["ior"]
    if "subsurfaceRadius" in entry:
        out["subsurface"] = 1
    if entry.get("transmission"):
        out["transmission"] = entry["transmission"]
        out |= _absorption(entry.get("volumeCoefficients", {}).get("absorption", [0.0]))
    return out


def _absorption(rates: list[float]) -> dict[str, Any]:
    """What holds inside a body that absorbs at these rates, 1/cm; the body's surface tints nothing then."""
    most = max(rates)
    if most < TRANSPARENT:
        return {}
    return {
        "base_color": 1,
        "attenuation_color": [round(math.exp(-rate / most), 5) for rate in rates],
        "attenuation_distance": float(f"{1 / (METRE * most):.5g}"),
    }
