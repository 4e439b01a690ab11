"""Displays and their views of OpenColorIO's configuration, by which a tone map may be named.

Nothing heavy is imported here: the table is written out, and a test compares it with the library's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

# OpenImageIO's wheel brings OpenColorIO along, whose built-in configurations have names that stay: "ocio://default"
# would be another configuration in a later version, and a picture made again would look different.
CONFIGURATION = "ocio://cg-config-v4.0.0_aces-v2.0_ocio-v2.5"
SOURCE = "Linear Rec.709 (sRGB)"  # the name of our radiance there
PREFIX = "ocio:"

Primaries = Literal["rec709", "p3", "rec2020"]
_SDR_709, _SDR_P3 = "ACES 2.0 - SDR 100 nits (Rec.709)", "ACES 2.0 - SDR 100 nits (P3 D65)"
_HDR_P3, _HDR_2020 = "ACES 2.0 - HDR 1000 nits (P3 D65)", "ACES 2.0 - HDR 1000 nits (Rec.2020)"
_PLAIN = ("Un-tone-mapped", "Video (colorimetric)", "Raw")


@dataclass(frozen=True)
class Encoding:
    """The meaning of a picture's numbers. `transfer`: "srgb", "pq" (SMPTE ST 2084), or a power law's exponent."""

    primaries: Primaries = "rec709"
    transfer: Literal["srgb", "pq"] | float = "srgb"


@dataclass(frozen=True)
class _Display:
    encoding: Encoding
    views: tuple[str, ...]


SRGB, DISPLAY_P3 = Encoding(), Encoding("p3")
# Without "Display P3 HDR - Display", whose values go beyond 1, which no format here stores.
DISPLAYS = {
    "sRGB - Display": _Display(SRGB, (_SDR_709, *_PLAIN)),
    "Display P3 - Display": _Display(DISPLAY_P3, (_SDR_P3, *_PLAIN)),
    "Gamma 2.2 Rec.709 - Display": _Display(Encoding("rec709", 2.2), (_SDR_709, *_PLAIN)),
    "P3-D65 - Display": _Display(Encoding("p3", 2.6), (_SDR_P3, _SDR_709, *_PLAIN)),
    "Rec.1886 Rec.709 - Display": _Display(Encoding("rec709", 2.4), (_SDR_709, *_PLAIN)),
    "Rec.2100-PQ - Display": _Display(Encoding("rec2020", "pq"), (_HDR_P3, _HDR_2020, _SDR_709, *_PLAIN)),
    "ST2084-P3-D65 - Display": _Display(Encoding("p3", "pq"), (_HDR_P3, _SDR_709, *_PLAIN)),
}
# Short names, and what each stands for on an sRGB screen and on one of Display P3.
SHORT = {"aces2": (("sRGB - Display", _SDR_709), ("Display P3 - Display", _SDR_P3))}


def names() -> list[str]:
    """All tone maps that name a display and a view."""
    return [f"{PREFIX}{display}/{view}" for display, row in DISPLAYS.items() for view in row.views]


def view_of(tone_map: str, p3: bool = False) -> tuple[str, str] | None:
    """The display and the view that a tone map names; None where it is a curve. `p3`: the screen is of Display P3."""
    if tone_map in SHORT:
        return SHORT[tone_map][p3]
    if not tone_map.startswith(PREFIX):
        return None
    display, _, view = tone_map.removeprefix(PREFIX).partition("/")
    return display, view


def mistake(tone_map: str) -> str | None:
    """The mistake in a tone map that names a display and a view; None: there is none."""
    display, _, view = tone_map.removeprefix(PREFIX).partition("/")
    if display not in DISPLAYS:
        known = ", ".join(map(repr, DISPLAYS))
        return f"names no display: {PREFIX}DISPLAY/VIEW, where DISPLAY is one of {known}"
    if view not in DISPLAYS[display].views:
        return f"names no view: those of {display!r} are {', '.join(map(repr, DISPLAYS[display].views))}"
    return None


def encoding_of(tone_map: str, p3: bool = False) -> Encoding:
    """The encoding of a picture's numbers under this tone map."""
    found = view_of(tone_map, p3)
    if found is None:
        return DISPLAY_P3 if p3 else SRGB
    return DISPLAYS[found[0]].encoding
