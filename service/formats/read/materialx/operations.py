"""Operations of the standard library for arrays of texels: (n, size), or (1, size) where all texels have the same.
They mean what the library's GLSL means (MaterialX, libraries/stdlib/genglsl)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from service.formats.read.materialx import noise
from service.formats.surface import trees
from service.formats.surface.trees import LUMINANCE, TINY, Operation, Tree, Unsupported, Values
from service.formats.types import Floats


def _shares(v: Values, blended: Callable[[Floats, Floats], Any]) -> Any:
    """`blended(background, foreground)` by the input `mix`, the background where that is 0."""
    return v["mix"] * blended(v["bg"], v["fg"]) + (1 - v["mix"]) * v["bg"]


def _burn(b: Floats, f: Floats) -> Any:
    return 1 - (1 - b) / np.where(np.abs(f) < TINY, 1, f)


def _dodge(b: Floats, f: Floats) -> Any:
    return b / np.where(np.abs(1 - f) < TINY, 1, 1 - f)


def _length(a: Floats) -> Any:
    return np.sqrt(np.einsum("ij,ij->i", a, a))[:, None]


def _normalized(v: Values, tree: Tree) -> Any:
    length = _length(v["in"])
    return v["in"] / np.where(length > 0, length, 1)


def _combined(v: Values, tree: Tree) -> Any:
    parts = [v[name] for name in ("in1", "in2", "in3", "in4") if name in v]
    rows = max(map(len, parts))
    return np.concatenate([np.broadcast_to(part, (rows, part.shape[1])) for part in parts], axis=1)


def _extracted(v: Values, tree: Tree) -> Any:
    index = int(v["index"].flat[0])
    if not 0 <= index < v["in"].shape[1]:
        raise Unsupported(f"extracts channel {index} of {v['in'].shape[1]}")
    return v["in"][:, [index]]


def _rotated(v: Values, tree: Tree) -> Any:
    turn = np.radians(v["amount"][:, 0])
    x, y, s, c = v["in"][:, 0], v["in"][:, 1], np.sin(turn), np.cos(turn)
    return np.stack(np.broadcast_arrays(c * x + s * y, c * y - s * x), axis=-1)


def _rotated_about(v: Values, tree: Tree) -> Any:
    """Rodrigues' formula, for row vectors as the library has it: clockwise about the axis."""
    turn, axis = np.radians(v["amount"]), v["axis"] / np.linalg.norm(v["axis"], axis=1, keepdims=True)
    s, c = np.sin(turn), np.cos(turn)
    along = (axis * v["in"]).sum(axis=1, keepdims=True)
    return v["in"] * c + np.cross(v["in"], axis) * s + axis * along * (1 - c)


def _chosen(better: Callable[[Floats, Floats], Any]) -> Operation:
    return lambda v, tree: np.where(better(v["value1"], v["value2"]), v["in1"], v["in2"])


def _smooth(v: Values, tree: Tree) -> Any:
    low, high = v["low"], v["high"]
    t = np.clip((v["in"] - low) / np.where(high == low, 1, high - low), 0, 1)
    return np.where(v["in"] >= high, 1, np.where(v["in"] <= low, 0, t * t * (3 - 2 * t)))


def _luminance(v: Values, tree: Tree) -> Any:
    weights = v.get("lumacoeffs", np.array([LUMINANCE], np.float32))
    grey = (v["in"][:, :3] * weights).sum(axis=1, keepdims=True)
    return np.concatenate([np.repeat(grey, 3, axis=1), v["in"][:, 3:]], axis=1)


def _hsv(v: Values, tree: Tree) -> Any:
    rgb = v["in"][:, :3]
    high, low = rgb.max(axis=1), rgb.min(axis=1)
    delta = high - low
    safe = np.where(delta > 0, delta, 1)
    r, g, b = rgb.T
    h = np.where(r >= high, (g - b) / safe, np.where(g >= high, 2 + (b - r) / safe, 4 + (r - g) / safe)) / 6
    s = np.where(high > 0, delta / np.where(high > 0, high, 1), 0)
    h = np.where(s > 0, np.where(h < 0, h + 1, h), 0)
    return np.concatenate([np.stack([h, s, high], axis=-1), v["in"][:, 3:]], axis=1)


def _rgb(v: Values, tree: Tree) -> Any:
    h, s, value = v["in"][:, 0], v["in"][:, 1], v["in"][:, 2]
    h = 6 * (h - np.floor(h))
    k = np.trunc(h).astype(int)
    f = h - k
    p, q, t = value * (1 - s), value * (1 - s * f), value * (1 - s * (1 - f))
    rows = [(value, t, p), (q, value, p), (p, value, t), (p, q, value), (t, p, value), (value, p, q)]
    rgb = np.choose(np.clip(k, 0, 5), [np.stack(row, axis=-1).T for row in rows]).T
    rgb = np.where((s < 1e-4)[:, None], value[:, None], rgb)
    return np.concatenate([rgb, v["in"][:, 3:]], axis=1)


def _premultiplied(v: Values, tree: Tree) -> Any:
    return np.concatenate([v["in"][:, :3] * v["in"][:, 3:], v["in"][:, 3:]], axis=1)


def _unpremultiplied(v: Values, tree: Tree) -> Any:
    alpha = v["in"][:, 3:]
    return np.concatenate([v["in"][:, :3] / np.where(alpha == 0, 1, alpha), alpha], axis=1)


def _matrix(v: Values, tree: Tree) -> Any:
    """The file's matrices are written row by row for row vectors."""
    side = round(v["mat"].shape[1] ** 0.5)
    given = v["in"]
    filled = np.concatenate([given, np.ones((len(given), side - given.shape[1]), np.float32)], axis=1)
    return (filled @ v["mat"][0].reshape(side, side))[:, : given.shape[1]]


def _ramp(axis: int) -> Operation:
    first, second = ("valuel", "valuer") if axis == 0 else ("valueb", "valuet")

    def ramp(v: Values, tree: Tree) -> Any:
        share = np.clip(v["texcoord"][:, [axis]], 0, 1)
        return v[first] * (1 - share) + v[second] * share

    return ramp


def _split(axis: int) -> Operation:
    first, second = ("valuel", "valuer") if axis == 0 else ("valueb", "valuet")
    return lambda v, tree: np.where(v["texcoord"][:, [axis]] < v["center"], v[first], v[second])


def _noise(place: str) -> Operation:
    return lambda v, tree: noise.noise(v[place], tree.size) * v["amplitude"] + v["pivot"]


def _fractal(place: str) -> Operation:
    def fractal(v: Values, tree: Tree) -> Any:
        octaves = int(v["octaves"].flat[0])
        return noise.fractal(v[place], tree.size, octaves, v["lacunarity"], v["diminish"]) * v["amplitude"]

    return fractal


def _worley(place: str) -> Operation:
    def worley(v: Values, tree: Tree) -> Any:
        style = v.get("style")
        return noise.worley(v[place], tree.size, v["jitter"], style is not None and int(style.flat[0]) == 1)

    return worley


def _modulo(v: Values, tree: Tree) -> Any:
    by = np.where(v["in2"] == 0, 1, v["in2"])
    return v["in1"] - by * np.floor(v["in1"] / by)


OPERATIONS: dict[str, Operation] = {
    **trees.OPERATIONS,
    "modulo": _modulo,
    "min": trees.plain(np.minimum, "in1", "in2"),
    "max": trees.plain(np.maximum, "in1", "in2"),
    "invert": trees.plain(np.subtract, "amount", "in"),
    "fract": lambda v, tree: v["in"] - np.floor(v["in"]),
    "floor": trees.plain(np.floor, "in"),
    "ceil": trees.plain(np.ceil, "in"),
    "round": lambda v, tree: np.floor(v["in"] + 0.5),
    "sign": trees.plain(np.sign, "in"),
    "sin": trees.plain(np.sin, "in"),
    "cos": trees.plain(np.cos, "in"),
    "tan": trees.plain(np.tan, "in"),
    "asin": lambda v, tree: np.arcsin(np.clip(v["in"], -1, 1)),
    "acos": lambda v, tree: np.arccos(np.clip(v["in"], -1, 1)),
    "atan2": trees.plain(np.arctan2, "iny", "inx"),
    "sqrt": lambda v, tree: np.sqrt(np.maximum(v["in"], 0)),
    "ln": lambda v, tree: np.log(np.maximum(v["in"], TINY)),
    "exp": trees.plain(np.exp, "in"),
    "normalize": _normalized,
    "magnitude": lambda v, tree: _length(v["in"]),
    "crossproduct": lambda v, tree: np.cross(v["in1"], v["in2"]),
    "rotate2d": _rotated,
    "rotate3d": _rotated_about,
    "transformmatrix": _matrix,
    "combine2": _combined,
    "combine3": _combined,
    "combine4": _combined,
    "extract": _extracted,
    "convert": trees.plain(np.array, "in"),
    "dot": trees.plain(np.array, "in"),
    "remap": lambda v, tree: (
        v["outlow"] + (v["in"] - v["inlow"]) * (v["outhigh"] - v["outlow"]) / (v["inhigh"] - v["inlow"])
    ),
    "smoothstep": _smooth,
    "luminance": _luminance,
    "rgbtohsv": _hsv,
    "hsvtorgb": _rgb,
    "premult": _premultiplied,
    "unpremult": _unpremultiplied,
    "plus": lambda v, tree: _shares(v, lambda b, f: b + f),
    "minus": lambda v, tree: _shares(v, lambda b, f: b - f),
    "difference": lambda v, tree: _shares(v, lambda b, f: np.abs(b - f)),
    "screen": lambda v, tree: _shares(v, lambda b, f: 1 - (1 - f) * (1 - b)),
    "burn": lambda v, tree: np.where(np.abs(v["fg"]) < TINY, 0, _shares(v, _burn)),
    "dodge": lambda v, tree: np.where(np.abs(1 - v["fg"]) < TINY, 0, _shares(v, _dodge)),
    "in": lambda v, tree: _shares(v, lambda b, f: f * b[:, 3:]),
    "mask": lambda v, tree: _shares(v, lambda b, f: b * f[:, 3:]),
    "out": lambda v, tree: _shares(v, lambda b, f: f * (1 - b[:, 3:])),
    "over": lambda v, tree: _shares(v, lambda b, f: f + b * (1 - f[:, 3:])),
    "inside": trees.plain(np.multiply, "in", "mask"),
    "outside": lambda v, tree: v["in"] * (1 - v["mask"]),
    "ifgreater": _chosen(np.greater),
    "ifequal": _chosen(np.equal),
    "and": lambda v, tree: (v["in1"] > 0) & (v["in2"] > 0),
    "or": lambda v, tree: (v["in1"] > 0) | (v["in2"] > 0),
    "not": lambda v, tree: v["in"] <= 0,
    "ramplr": _ramp(0),
    "ramptb": _ramp(1),
    "splitlr": _split(0),
    "splittb": _split(1),
    "noise2d": _noise("texcoord"),
    "noise3d": _noise("position"),
    "fractal2d": _fractal("texcoord"),
    "fractal3d": _fractal("position"),
    "cellnoise2d": lambda v, tree: noise.cells(v["texcoord"]),
    "cellnoise3d": lambda v, tree: noise.cells(v["position"]),
    "worleynoise2d": _worley("texcoord"),
    "worleynoise3d": _worley("position"),
}

# How much longer a texel takes than for an addition.
WEIGHTS = {
    "noise2d": 40, "noise3d": 100, "fractal2d": 40, "fractal3d": 100, "cellnoise2d": 15, "cellnoise3d": 20,
    "worleynoise2d": 300, "worleynoise3d": 1000, "image": 20, "heighttonormal": 10,
}  # fmt: skip
