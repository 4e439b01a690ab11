"""A declared record: its members and their offsets, as a numpy dtype. `layout_glsl` writes it as GLSL."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from gpu.layout.bindings import Slot


class LayoutError(TypeError):
    """A declaration that would leave a hole between members, or name an unknown type."""


class Kind:
    """A member's type: its GLSL name, its size in 32-bit words, and numpy's element and dtype."""

    glsl: ClassVar[str]
    words: ClassVar[int]
    base: ClassVar[type[np.generic]] = np.float32
    dtype: ClassVar[np.dtype[Any]]

    def __init_subclass__(cls) -> None:
        cls.dtype = np.dtype((cls.base, (cls.words,)) if cls.words > 1 else cls.base)


class f32(Kind):
    glsl, words = "float", 1


class u32(Kind):
    glsl, words, base = "uint", 1, np.uint32


class vec2(Kind):
    glsl, words = "vec2", 2


class uvec2(Kind):
    glsl, words, base = "uvec2", 2, np.uint32


class vec3(Kind):
    glsl, words = "vec3", 3


class vec4(Kind):
    glsl, words = "vec4", 4


_KINDS: dict[str, type[Kind]] = {k.__name__: k for k in (f32, u32, vec2, uvec2, vec3, vec4)}


class Record(Kind):
    """Base of all records: members in order, a vec3 followed by a scalar, no hole between members.

    A member may be another record, whose size is then a multiple of four words, as GLSL rounds it up to that.
    """

    glsl, words, base = "", 0, np.void
    members: ClassVar[dict[str, type[Kind]]]
    offsets: ClassVar[dict[str, int]]  # in words
    slot: ClassVar[Slot | None] = None

    def __init_subclass__(cls) -> None:
        cls.members = {}
        for name, kind in cls.__annotations__.items():
            if kind not in _KINDS:
                raise LayoutError(f"{cls.__name__}.{name}: unknown type {kind!r}; have {sorted(_KINDS)}")
            cls.members[name] = _KINDS[kind]
        cls.offsets, end = {}, 0
        for name, kind_ in cls.members.items():
            align = {1: 1, 2: 2}.get(kind_.words, 4)
            if kind_.base is np.void and kind_.words % 4:
                raise LayoutError(f"{cls.__name__}.{name}: a hole after it, as it has {kind_.words} words")
            if end % align:
                raise LayoutError(f"{cls.__name__}.{name}: a hole of {align - end % align} words before it")
            cls.offsets[name] = end
            end += kind_.words
        group = 4 if end > 2 else 2
        cls.glsl, cls.words = cls.__name__, -(-end // group) * group
        cls.dtype = np.dtype(
            {
                "names": list(cls.members),
                "formats": [k.dtype for k in cls.members.values()],
                "offsets": [4 * o for o in cls.offsets.values()],
                "itemsize": 4 * cls.words,
            }
        )
        _KINDS[cls.__name__] = cls
