"""The layers of an EXR: which pictures its channels make, and which of them is shown. Runs in the parsing child."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from service.formats.errors import LAYER, ParseError

COLOUR = (("r", "g", "b"), ("red", "green", "blue"))  # names of channels, in lower case
VECTOR = ("x", "y", "z")
ALPHA = ("a", "alpha")
CHROMA = ("ry", "by")
# Names of the layer that is the picture itself, the likeliest first.
BEAUTY = ("beauty", "combined", "rgba", "rgb", "color", "colour")
DATA = ("z", "zback", "depth", "id", "ids", "objectid", "materialid", "index", "indexob", "indexma")
MOST_NAMES = 20  # in a message


@dataclass(frozen=True)
class Layer:
    """Channels of one part that make an image: red, green and blue with or without alpha, or a single one."""

    name: str  # "" for the R, G and B of a file with one part
    part: int
    channels: tuple[int, ...]  # their places
    is_colour: bool = True
    is_chroma: bool = False  # Y, RY and BY instead


@dataclass(frozen=True)
class Choice:
    """The layer that is shown, with the names of all and what is to be told."""

    layer: Layer
    names: tuple[str, ...]
    warnings: tuple[str, ...]


def choose(file: Any, wanted: str = "") -> Choice:
    """The layer to show of a file that is open in OpenImageIO, which then stands at its part: the one of the name
    that is wanted, else the likeliest. Raises ParseError."""
    parts = list(_parts(file))
    if not any(channels for _, channels in parts):
        raise ParseError("deep images are not supported")
    layers = [layer for k, (name, channels) in enumerate(parts) for layer in _layers(k, name, channels, len(parts))]
    names = tuple(dict.fromkeys(layer.name for layer in layers))
    chosen, warnings = (_named(layers, wanted), ()) if wanted else _likeliest(layers, parts)
    file.seek_subimage(chosen.part, 0)
    return Choice(chosen, names if len(names) > 1 else (), warnings)


def check_sampling(attributes: dict[str, bytes]) -> None:
    """Refuse subsampled channels by name: OpenImageIO opens no file that has them."""
    for name, across, down in _sampling(attributes.get("channels", b"")):
        if (across, down) != (1, 1):
            if name.lower().rpartition(".")[2] in CHROMA:
                raise ParseError("its chroma is subsampled (luminance/chroma); save it as RGB")
            raise ParseError(f"its channel {name} is subsampled; save it with a value for every pixel")


def listed(names: Iterable[str]) -> str:
    """Names in a message, bounded."""
    shown = list(names)
    more = len(shown) - MOST_NAMES
    return ", ".join(name or "R, G, B" for name in shown[:MOST_NAMES]) + (f" and {more} more" if more > 0 else "")


def _sampling(channels: bytes) -> Iterator[tuple[str, int, int]]:
    """Name, and distances of values across and down, of each channel in a header's list."""
    at = 0
    while (end := channels.find(b"\0", at)) > at and end + 17 <= len(channels):
        across, down = struct.unpack_from("<ii", channels, end + 9)
        yield channels[at:end].decode("latin-1"), across, down
        at = end + 17


def _parts(file: Any) -> Iterator[tuple[str, list[str]]]:
    """The name and the names of the channels of each part; of a deep one none, as no layer of it is shown."""
    part = 0
    while file.seek_subimage(part, 0):
        spec = file.spec()
        yield spec.get_string_attribute("oiio:subimagename"), [] if spec.deep else list(spec.channelnames)
        part += 1


def _layers(part: int, title: str, channels: list[str], parts: int) -> Iterator[Layer]:
    """The layers of a part, pictures before single channels."""
    title = (title or f"part {part + 1}") if parts > 1 else ""
    groups: dict[str, dict[str, int]] = {}
    for place, channel in enumerate(channels):
        layer, _, name = channel.rpartition(".")
        groups.setdefault(layer, {}).setdefault(name.lower(), place)
    used: set[int] = set()
    for layer, places in groups.items():
        alpha = [places[name] for name in ALPHA if name in places][:1]
        chroma = all(name in places for name in ("y", *CHROMA))
        for names in (*COLOUR, ("y", *CHROMA), VECTOR, ("y",)):
            if all(name in places for name in names):
                found = tuple(places[name] for name in names)
                found = found * 3 if len(found) == 1 and alpha else found
                yield Layer(layer or title, part, (*found, *alpha), names != VECTOR, chroma and len(names) == 3)
                used.update(found, alpha)
                break
    for place, channel in enumerate(channels):
        if place not in used:
            alone = len(channels) == 1 and channel.lower().rpartition(".")[2] not in DATA
            yield Layer(f"{title}.{channel}" if title else channel, part, (place,), is_colour=alone)


def _named(layers: list[Layer], wanted: str) -> Layer:
    exact = [layer for layer in layers if layer.name == wanted]
    found = exact or [layer for layer in layers if layer.name.lower() == wanted.lower()]
    if found:
        return found[0]
    names = [name for name in dict.fromkeys(layer.name for layer in layers) if name]
    has = f"it has {listed(names)}" if names else "it has none beside the one that is shown without a name"
    raise ParseError(f"it has no layer {wanted[:100]!r}; {has}", LAYER)


def _likeliest(layers: list[Layer], parts: list[tuple[str, list[str]]]) -> tuple[Layer, tuple[str, ...]]:
    """The layer that is shown without a name, and what is to be told of the choice."""
    colours = [layer for layer in layers if layer.is_colour and len(layer.channels) > 1]
    pictures = colours or [layer for layer in layers if layer.is_colour]
    if not pictures:
        raise ParseError(f"it has no channels R, G and B; it has {listed(_whole_names(parts))}: data, not a picture")
    chosen = min(pictures, key=_rank)  # the first of equals
    names = list(dict.fromkeys(layer.name for layer in pictures))
    if len(names) == 1 or not chosen.name:
        return chosen, ()
    others = "choose another one by `layer`"
    return chosen, (f"layer {chosen.name} of {listed(names)} is shown; {others}",)


def _whole_names(parts: list[tuple[str, list[str]]]) -> list[str]:
    return [channel for _, channels in parts for channel in channels]


def _rank(layer: Layer) -> tuple[int, int]:
    """Plain R, G and B first, then a name that says picture as its last word, then as any, then in the file's order;
    ids that look like colours last."""
    words = layer.name.lower().replace("_", ".").split(".")
    if not layer.name:
        return 0, 0
    if words[-1] in BEAUTY:
        return 1, BEAUTY.index(words[-1])
    found = [BEAUTY.index(word) for word in words if word in BEAUTY]
    if found:
        return 2, min(found)
    return (4 if any(word.startswith("crypto") for word in words) else 3), 0
