"""The material models as GLSL: which of their functions is called, picked by the number of the model.

`models.glsl` includes `bsdf/models/NAME.glsl` of every model and calls its functions, each guarded by its flag:

    NAME_surface(m, tangent, s)                sets members of the surface; surface_plain has set the others
    NAME_eval(s, wo, wi)                       the Scatter, whose f lacks the cosine of wi
    NAME_sample(s, wo, u_lobe, u)              a LobeSample

and where the row in `gpu/layout/models.py` says so:

    NAME_face(wo, behind, s)                   `depends_on_wo`: completes the surface
    NAME_coat_eval(s, wo, wi)                  `has_coat_normals`: the Scatter of the coat alone, with the cosine
    NAME_deltas(s, wo, deltas)                 `may_be_delta`: its perfectly specular lobes
    NAME_delta_chance(s, wo)                   `may_be_delta`: the chance that NAME_sample picks one of them
    NAME_sample_delta(wo, behind, u_lobe, least, s)
                                               `may_be_delta`: a LobeSample where it has no other lobes, each picked
                                               with a chance of at least `least`
    NAME_straight(wo, behind, s)               `may_be_delta`: the share of light from wo that goes straight through a
                                               surface that bends nothing
    NAME_emitted(wo, behind, s)                `covers_emission`: what its layers leave of its own light
    NAME_left(s, wi)                           `walks`: what the surface leaves of light that comes out from under it;
                                               NAME_sample has a lobe that enters
    NAME_terms(s, wo, wi, wm)                  `has_terms`: the Terms for a facet's normal wm
    NAME_metal(s, c), NAME_metal_mean(s)       `needs_tables`: the metal's reflectance at cosine c, and its mean
    NAME_tinted(s, f)                          `needs_tables`: the dielectric's reflectance f with the model's colour

The last three are called by `bsdf/lobes/base/`, which the models that look up the tables share.

`model_members.glsl` is what models add to Surface. Both exist only in memory, as `layout.glsl` does.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from gpu.layout.models import FLAGGED, MODELS, Model


def members() -> str:
    """The text of `model_members.glsl`."""
    return _includes(f"{model.name}_members" for model in MODELS if model.has_members)


def predicates() -> str:
    """Functions that say what the model of a number can do, and where a material has what several models need."""
    return "\n".join([*(_predicate(trait) for trait in ("transmits", "may_be_delta", "walks")), _walk_color()])


def text() -> str:
    """The text of `models.glsl`."""
    coats, deltas, tabulated = _with("has_coat_normals"), _with("may_be_delta"), _with("needs_tables")
    bases = {
        "vec3 models_metal(Surface s, float c)": "{}_metal(s, c)",
        "vec3 models_metal_mean(Surface s)": "{}_metal_mean(s)",
        "vec3 models_tinted(Surface s, BASE_SHARE f)": "{}_tinted(s, f)",
    }
    return "\n".join([
        *(f"{head};" for head in bases),  # their callers come before the models
        _includes(model.name for model in MODELS),
        _dispatcher("void models_surface(Material m, vec2 tangent, inout Surface s)",
                    _base("{}_surface(m, tangent, s);"), _ladder(FLAGGED, "{}_surface(m, tangent, s);")),
        _dispatcher("Scatter models_eval(Surface s, vec3 wo, vec3 wi)",
                    _base("Scatter r = {}_eval(s, wo, wi);"), _lobes(FLAGGED, "r = {}_eval(s, wo, wi);")),
        _dispatcher("LobeSample models_sample(Surface s, vec3 wo, float u_lobe, vec2 u)",
                    _base("LobeSample r = {}_sample(s, wo, u_lobe, u);"),
                    _lobes(FLAGGED, "r = {}_sample(s, wo, u_lobe, u);")),
        _dispatcher("void models_face(vec3 wo, bool behind, inout Surface s)",
                    "", _lobes(_with("depends_on_wo"), "{}_face(wo, behind, s);")),
        "#if HAS_COAT_NORMALS",
        _dispatcher("Scatter models_coat_eval(Surface s, vec3 wo, vec3 wi)",
                    "Scatter r = Scatter(vec3(0.0), 0.0);", _lobes(coats, "r = {}_coat_eval(s, wo, wi);")),
        "#endif",
        _dispatcher("void models_deltas(Surface s, vec3 wo, inout LobeSample deltas[BSDF_DELTAS])",
                    "", _lobes(deltas, "{}_deltas(s, wo, deltas);")),
        _dispatcher("float models_delta_chance(Surface s, vec3 wo)",
                    "float r = 0.0;", _lobes(deltas, "r = {}_delta_chance(s, wo);")),
        _dispatcher("LobeSample models_sample_delta(vec3 wo, bool behind, float u_lobe, float least, "
                    "inout Surface s)",
                    "LobeSample r = bsdf_rough_sample(vec3(0.0));",
                    _only(deltas, "r = {}_sample_delta(wo, behind, u_lobe, least, s);")),
        _dispatcher("vec3 models_straight(vec3 wo, bool behind, inout Surface s)",
                    "vec3 r = vec3(0.0);", _only(deltas, "r = {}_straight(wo, behind, s);")),
        _dispatcher("vec3 models_emitted(vec3 wo, bool behind, inout Surface s)",
                    "vec3 r = vec3(1.0);", _ladder(_with("covers_emission"), "r = {}_emitted(wo, behind, s);")),
        "#if HAS_WALKS",
        _dispatcher("vec3 models_left(Surface s, vec3 wi)",
                    "vec3 r = vec3(1.0);", _lobes(_with("walks"), "r = {}_left(s, wi);")),
        "#endif",
        _dispatcher("Terms models_terms(Surface s, vec3 wo, vec3 wi, vec3 wm)",
                    "Terms r = Terms(vec3(0.0), 0.0, 0.0, true);",
                    _ladder(_with("has_terms"), "r = {}_terms(s, wo, wi, wm);")),
        *(_dispatcher(head, "vec3 r = vec3(0.0);", _only(tabulated, f"r = {call};")) for head, call in bases.items()),
    ])  # fmt: skip


def _with(trait: str) -> Sequence[Model]:
    return [model for model in FLAGGED if getattr(model, trait)]


def _predicate(trait: str) -> str:
    any_of = " || ".join(_is("model", each) for each in _with(trait))
    return f"bool model_{trait}(uint model) {{ return {any_of}; }}"


def _walk_color() -> str:
    """`model_walk_color(m)`, for materials whose model walks."""
    *others, last = _with("walks")
    rungs = "".join(f"{_is('m.model', model)} ? m.{model.walk_color} : " for model in others)
    return f"vec3 model_walk_color(Material m) {{ return {rungs}m.{last.walk_color}; }}"


def _includes(names: Iterable[str]) -> str:
    return "\n".join(f'#include "bsdf/models/{name}.glsl"' for name in names)


def _is(number: str, model: Model) -> str:
    return f"{number} == MODEL_{model.name.upper()}"


def _base(call: str) -> str:
    return call.format(MODELS[0].name)


def _dispatcher(head: str, first: str, rungs: str) -> str:
    last = "" if head.startswith("void") else "return r;\n"
    return f"{head} {{\n{first}\n{rungs}\n{last}}}"


def _rung(model: Model, flag: str, call: str) -> str:
    return f"#if {flag}\nif ({_is('s.model', model)}) {call.format(model.name)}\n#endif"


def _ladder(models: Sequence[Model], call: str) -> str:
    """The call for the surface's model, where the kernel knows that."""
    return "\n".join(_rung(model, model.flag, call) for model in models)


def _lobes(models: Sequence[Model], call: str) -> str:
    """The call for the surface's model, where the kernel has its lobes."""
    return "\n".join(_rung(model, model.lobes_flag, call) for model in models)


def _only(models: Sequence[Model], call: str) -> str:
    """The same for surfaces that are surely of one of these models: a kernel that knows only one does not ask."""
    several = " + ".join(model.flag for model in models) + " > 1"
    return "\n".join(
        f"#if {model.flag}\n#if {several}\nif ({_is('s.model', model)})\n#endif\n{call.format(model.name)}\n#endif"
        for model in models
    )
