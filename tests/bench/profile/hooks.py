"""The lines of the shaders at which is counted. Where a shader changes, a hook moves with it: `LineGone` says which.

llvmpipe runs the 8 lanes of a vector in lockstep. So an atomic addition counts lanes, while all active lanes together
count one turn where each of them reads a shared number, adds 1 and writes it back.
"""

from __future__ import annotations

from tests.bench.profile.instrumented import Edit

LANES = 8  # of a vector of 256 bits
ANY = "any"  # in place of a kind of ray
RAYS = ("camera", "shadow", "extension")  # kinds of rays: an extension goes from a surface to the next one
EVENTS = ("ray", "box", "shape", "leaves", "bounce", "light", "mirror")
WHAT = {
    "ray": "rays",
    "box": "boxes tested",
    "shape": "shapes of leaves tested",
    "leaves": "turns of the loop that finds leaves and tests them",
    "bounce": "bounces at surfaces that are no mirrors",
    "light": "samples of lights",
    "mirror": "bounces at mirrors and clear glass",
}
KINDS = (ANY, *RAYS)
_OF_A_VECTOR = len(KINDS) * len(EVENTS)
COUNTERS = 2 * _OF_A_VECTOR  # turns of vectors, then lanes


def _event(name: str) -> str:
    return f"profile_event({EVENTS.index(name)}u);"


def _ray(kind: str) -> str:
    return f"profile_ray({KINDS.index(kind)}u);"


HOOKS = (
    Edit("pathtrace.comp", "    uvec2 pixel;", "    profile_begin();"),
    Edit("pathtrace.comp", "    sums[slot] = sum;", "    profile_end();"),
    Edit("path/path.glsl", "Surface s = interaction_surface(here, hues_leading(m, path.hues));", _event("bounce")),
    Edit("path/direct.glsl", "return lights_sample(", _event("light")),
    Edit("path/direct.glsl", "uvec2 skip = uvec2(terminator_skip(path.at, light.wi), light.id);", _ray("shadow")),
    Edit("path/delta_chain.glsl", "LobeSample lobe = dispersion_sample_delta(", _event("mirror")),
    Edit("path/path_trace.glsl", "path.hit = transparency_nearest(", f"if (path.bounce == 0u) {_ray('camera')}"),
    Edit("path/path_trace.glsl", "path.hit = transparency_nearest(", f"if (path.bounce > 0u) {_ray('extension')}"),
    Edit("shapes/traverse.glsl", "uvec4 node = node_words[", _event("box")),
    Edit("shapes/traverse.glsl", "traverse_test(tree, ray, range.kind", _event("shape")),
    Edit("shapes/traverse.glsl", "found = traverse_boxes(", _event("leaves")),
)

FUNCTIONS = f"""
const uint PROFILE_LANES = {LANES}u, PROFILE_EVENTS = {len(EVENTS)}u, PROFILE_COUNTERS = {_OF_A_VECTOR}u;
shared uint profile_turns[(WORK_GROUP * WORK_GROUP / {LANES}) * {_OF_A_VECTOR}];
uint profile_kind = 0u;

uint profile_first() {{ return (gl_LocalInvocationIndex / PROFILE_LANES) * PROFILE_COUNTERS; }}

void profile_begin() {{
    for (uint i = 0u; i < PROFILE_COUNTERS; i++) profile_turns[profile_first() + i] = 0u;
}}

void profile_add(uint counter) {{
    uint at = profile_first() + counter;
    memoryBarrierShared();
    uint before = profile_turns[at];
    memoryBarrierShared();
    profile_turns[at] = before + 1u;
    memoryBarrierShared();
    atomicAdd(counts[PROFILE_COUNTERS + counter], 1u);
}}

void profile_event(uint event) {{
    profile_add(event);
    profile_add(profile_kind * PROFILE_EVENTS + event);
}}

void profile_ray(uint kind) {{
    profile_kind = kind;
    profile_event({EVENTS.index("ray")}u);
}}

void profile_end() {{
    if (gl_LocalInvocationIndex % PROFILE_LANES == 0u) {{
        for (uint i = 0u; i < PROFILE_COUNTERS; i++) atomicAdd(counts[i], profile_turns[profile_first() + i]);
    }}
}}
"""
