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

from service.document.material.parameters import LEAST_CONDUCTOR

KIND = "database"  # a part of the library of its own
PREFIX = "physically-based-"
METRE = 100  # cm
DYED = 0.1  # a metal's colour that is farther than this from the reflectance of its index is not the metal's own
TRANSPARENT = 1e-6  # 1/cm; where light goes farther than 10 km nothing is seen of what is absorbed


@cache
def database() -> dict[str, Any]:
    """The file: where its values come from, and `materials`."""
    path = files("service.document.presets").joinpath("physically_based.json")
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
    """The `principled` material of an entry. Reflectances above 1, which some metals have in a channel, are 1; metals
    that are not dyed have a complex index besides."""
    out: dict[str, Any] = {
        "type": "principled",
        "base_color": [min(1.0, channel) for channel in entry["color"]],
        "roughness": entry["roughness"],
    }
    if "thinFilmThickness" in entry:
        out |= {"film_thickness": _typical(entry["thinFilmThickness"]), "film_ior": entry["thinFilmIor"]}
    if entry["metalness"]:
        return out | {"metallic": entry["metalness"]} | _complex_index(entry, out["base_color"])
    if "ior" in entry:
        out["ior"] = entry["ior"]
    if "subsurfaceRadius" in entry:
        out["subsurface"] = 1
    if entry.get("transmission"):
        out["transmission"] = entry["transmission"]
        out |= _absorption(entry.get("volumeCoefficients", {}).get("absorption", [0.0]))
        if "transmissionDispersion" in entry:
            out["abbe"] = entry["transmissionDispersion"]
    return out


def _typical(values: list[float]) -> float:
    """The most common value where a range names one; the middle of a range; the only value."""
    return values[2] if len(values) == 3 else sum(values) / len(values)


def _complex_index(entry: dict[str, Any], color: list[float]) -> dict[str, Any]:
    """The entry's n and k, nothing for dyed metals. As the entries have them they are too dark in blue, by 7 %,
    as if white were that of equal energy: k, or where that cannot be n, is turned so that the metal reflects the
    entry's colour head-on."""
    given = entry.get("complexIor")
    if given is None:
        return {}
    pairs = list(zip(given["n"], given["k"], strict=True))
    found = [((n - 1) ** 2 + k * k) / ((n + 1) ** 2 + k * k) for n, k in pairs]
    if max(abs(f - c) for f, c in zip(found, color, strict=True)) > DYED:
        return {}
    turned = [_turned(max(n, LEAST_CONDUCTOR), k, c) for (n, k), c in zip(pairs, color, strict=True)]  # n may be 0
    return {name: [float(f"{x[i]:.5g}") for x in turned] for i, name in enumerate(("conductor_eta", "conductor_k"))}


def _turned(n: float, k: float, reflectance: float) -> tuple[float, float]:
    """An index near n + i k that reflects so much head-on."""
    if reflectance >= 1:
        return n, k
    square = ((n + 1) ** 2 * reflectance - (n - 1) ** 2) / (1 - reflectance)
    if square >= 0:
        return n, math.sqrt(square)
    more, less = 1 + reflectance, 1 - reflectance
    return (more - math.sqrt(more**2 - less**2 * (1 + k * k))) / less, k


def _absorption(rates: list[float]) -> dict[str, Any]:
    """Parameters of a body that absorbs at these rates, 1/cm; its surface tints nothing then."""
    most = max(rates)
    if most < TRANSPARENT:
        return {}
    return {
        "base_color": 1,
        "attenuation_color": [round(math.exp(-rate / most), 5) for rate in rates],
        "attenuation_distance": float(f"{1 / (METRE * most):.5g}"),
    }
