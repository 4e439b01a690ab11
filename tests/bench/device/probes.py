"""What arithmetic a driver's compiler makes of GLSL: NaN, contraction, rounding, filters, division by zero."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from gpu import context as contexts
from tests.bench.device.part import Options, Row

COUNT = 1 << 18
HEAD = """#version 430
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer a_buffer { float a[]; };
layout(std430, binding = 1) readonly buffer b_buffer { float b[]; };
layout(std430, binding = 2) writeonly buffer o_buffer { float o[]; };
uint count_hits(bool x) { return x ? 1u : 0u; }
"""
LOGIC = {  # of x = NaN, y = 1 and z = 0: the value that the shaders count on
    "max(NaN, 1)": ("max(x, y)", None),
    "max(1, NaN)": ("max(y, x)", None),
    "min(NaN, 1)": ("min(x, y)", None),
    "clamp(NaN, 0, 1)": ("clamp(x, 0.0, y)", None),
    "NaN < 1": ("x < y ? 1.0 : 0.0", 0.0),
    "!(NaN < 1)": ("!(x < y) ? 1.0 : 0.0", 1.0),
    "NaN >= 1": ("x >= y ? 1.0 : 0.0", 0.0),
    "NaN == NaN": ("x == x ? 1.0 : 0.0", 0.0),
    "isnan(NaN)": ("isnan(x) ? 1.0 : 0.0", 1.0),
    "0 / 0 is NaN": ("isnan(z / z) ? 1.0 : 0.0", 1.0),
    "1 / 0 is inf": ("isinf(y / z) ? 1.0 : 0.0", 1.0),
    "inf - inf is NaN": ("isnan(y / z + (y - 2.0) / z) ? 1.0 : 0.0", 1.0),
    "sqrt(-1) is NaN": ("isnan(sqrt(-y)) ? 1.0 : 0.0", 1.0),
    "a denormal stays": ("y * 1e-40 != 0.0 ? 1.0 : 0.0", None),
    "any(lessThan(vec3(NaN, 0, 0), 1)) of NaN": ("lessThan(vec3(x), vec3(y)).x ? 1.0 : 0.0", 0.0),
    "7u / 0u": ("float(7u / uint(z))", None),
    "1u << 32": ("float(1u << uint(y + 31.0))", None),
    "uint(-1.0)": ("float(uint(-y))", None),
    "int(NaN)": ("float(int(x))", None),
}
FUNCTIONS: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {  # what each should be, in doubles
    "a / b": lambda a, b: a / b,
    "1 / b": lambda a, b: 1 / b,
    "sqrt(b)": lambda a, b: np.sqrt(b),
    "inversesqrt(b)": lambda a, b: 1 / np.sqrt(b),
    "exp(-b)": lambda a, b: np.exp(-b),
    "log(b)": lambda a, b: np.log(b),
    "pow(b, 2.4)": lambda a, b: b**2.4,
    "sin(a)": lambda a, b: np.sin(a),
    "cos(a)": lambda a, b: np.cos(a),
    "atan(a, b)": lambda a, b: np.arctan2(a, b),
    "acos(a / 8)": lambda a, b: np.arccos(np.float32(a / 8).astype(np.float64)),
    "a * b + a": lambda a, b: a * b + a,
}
CONTRACTED = """
void main() {
    uint i = gl_GlobalInvocationID.x;
    vec2 c = vec2(a[i], b[i]), d = c;
    %s float edge = c.x * d.y - c.y * d.x;
    o[i] = edge;
}
"""


def rows(options: Options) -> Iterator[Row]:
    context = contexts.create(options.device)
    for name, (expression, wanted) in LOGIC.items():
        body = f"void main() {{ float x = a[0], y = b[0], z = a[1]; o[gl_GlobalInvocationID.x] = {expression}; }}"
        got = float(_run(context, body, np.where(np.arange(64) == 1, 0, np.nan), np.ones(64))[0])
        yield {"what": name, "value": got, "fine": wanted is None or got == wanted}
    rng = np.random.default_rng(1)
    a = rng.uniform(-8, 8, COUNT).astype(np.float32)
    b = np.exp(rng.uniform(-7, 7, COUNT)).astype(np.float32)
    for expression, wished in FUNCTIONS.items():
        text = expression.replace("a", "x").replace("b", "y") if "(" not in expression else _named(expression)
        body = f"void main() {{ uint i = gl_GlobalInvocationID.x; float x = a[i], y = b[i]; o[i] = {text}; }}"
        values = _run(context, body, a, b).astype(np.float64)
        true = np.asarray(wished(a.astype(np.float64), b.astype(np.float64)))
        ulp = np.abs(values - true) / np.spacing(np.abs(true).astype(np.float32)).astype(np.float64)
        yield {"what": expression, "ulps_worst": float(ulp.max()), "ulps_p99": float(np.quantile(ulp, 0.99)),
               "absolute_worst": float(np.abs(values - true).max())}  # fmt: skip
    for word in ("", "precise"):
        edge = _run(context, CONTRACTED % word, a, b)
        yield {"what": f"c.x * d.y - c.y * d.x of equals {word}".strip(), "not_zero": int(np.count_nonzero(edge))}
    yield _filter(context)


def _named(expression: str) -> str:
    out, name = "", ""
    for letter in expression + " ":
        if letter.isalpha():
            name += letter
            continue
        out += {"a": "x", "b": "y"}.get(name, name) + letter
        name = ""
    return out.rstrip()


def _run(context: Any, body: str, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    kernel = context.compute_shader(HEAD + body)
    buffers = [context.buffer(np.asarray(values, np.float32).tobytes()) for values in (a, b)]
    buffers.append(context.buffer(reserve=4 * len(a)))
    for slot, buffer in enumerate(buffers):
        buffer.bind_to_storage_buffer(slot)
    kernel.run(max(1, len(a) // 64))
    context.memory_barrier()
    out = np.frombuffer(buffers[2].read(), np.float32).copy()
    for thing in (*buffers, kernel):
        thing.release()
    return out


def _filter(context: Any) -> Row:
    """How finely a texture's filter weighs between two texels."""
    texture = context.texture((2, 1), 1, np.array([0, 1], np.float32), dtype="f4")
    texture.use(0)
    body = """layout(binding = 0) uniform sampler2D t;
void main() { uint i = gl_GlobalInvocationID.x;
    o[i] = textureLod(t, vec2(0.25 + 0.5 * (float(i) + 0.5) / 65536.0, 0.5), 0.0).r; }"""
    got = _run(context, body, np.zeros(65536), np.zeros(65536))
    texture.release()
    levels = len(np.unique(got))
    wished = (np.arange(65536) + 0.5) / 65536
    return {"what": "levels between two texels of a filter", "value": levels, "worst": float(abs(got - wished).max())}
