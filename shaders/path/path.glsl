// The estimator: the light that reaches the camera along one path. path/path_trace.glsl traces a ray and
// adds the emission that it finds, path/interaction.glsl describes the surface, path/direct.glsl adds direct light,
// path/path_sample.glsl picks the next direction and path/path_extend.glsl turns the path there.
#include "bsdf/bsdf.glsl"
#include "lights/lights.glsl"
#include "shapes/transparency.glsl"
#include "path/medium.glsl"
#include "path/cone.glsl"
#include "path/found_light.glsl"
#include "path/sides.glsl"
#include "path/terminator.glsl"
#include "path/hues.glsl"
#include "path/path_extend.glsl"
#include "path/interaction.glsl"
#include "path/normal_map.glsl"
#include "path/bsdf_world.glsl"
#include "path/dispersion.glsl"
#include "path/light_layers.glsl"
#include "path/straight.glsl"
#include "path/path_sample.glsl"
#include "path/shadow.glsl"
#include "path/direct.glsl"
#include "path/path_shade.glsl"
#include "path/path_trace.glsl"
#include "path/delta_chain.glsl"

bool path_was_cut;   // the last path's budget did not last
bool path_was_lost;  // the driver has ended the last path before its time

// Begins a path that leaves the camera from o along d.
Path path_begin(Sampler rng, vec3 o, vec3 d, Medium medium, uint turn) {
    budget_begin();
    Path path;
    path.o = o;
    path.d = d;
    path.at.flat_id = NONE;
    path.throughput = vec3(1.0);
    path.radiance = vec3(0.0);
    path.bounce = 0u;
    path.alive = true;
    path.event = EVENT_NONE;
    path.found_pdf = PDF_DELTA;
    path.counts = true;
    path.travelled = 0.0;
    path.passed = 0u;
    path.eta_scale = 1.0;
    path.medium = medium;
    walk_begin(path);
    scatter_begin(path);
    path.cone = cone_begin(d);
    path.hues = hues_begin(rng, turn);
    caustics_begin(path);
    filter_glossy_begin(path);
    return path;
}

// Ends a path: adds light from infinity where it has left the scene. Returns its radiance and its alpha.
vec4 path_finish(Path path) {
    path_add_escaped(path);
    path_was_cut = !budget_lasts();
    // Mesa 22 may still end the loops first, without an error, where lanes have waited for each other. The last hit of
    // such a path may be wrong.
    path_was_lost = path.alive;
    return vec4(path_was_lost ? path.radiance_before : path.radiance, path.alpha);
}

// The path that brings light to o from the direction d.
Path path_follow(Sampler rng, vec3 o, vec3 d, Medium medium, uint turn) {
    Path path = path_begin(rng, o, d, medium, turn);
    path_trace_ahead(rng, path);
    if (path.alive) do {
        Interaction here;
        Material m;
        if (delta_chain(rng, path, here, m)) {
            walk_none(path);
            Surface s = interaction_surface(here, hues_leading(m, path.hues));
            LightContext lit = direct_context(path.at, here.front, here.facing, here.transmits);
            float share = direct_share(s, path.bounce);
            BsdfSample next = path_shade(s, here, m, lit, share, rng, path);
            if (!next.straight) path.lit = lit;
            bool crosses = dot(here.front, next.d) < 0.0 && !next.enters; // a walk comes out on this side
            path.medium = interaction_medium(crosses, path.medium, here.beyond);
            if (next.enters) walk_enter(m, path);
            path_extend(next, share, s, rng, path);
            path_trace_ahead(rng, path);
        }
    } while (path.alive);
    return path;
}

// The radiance that a path brings to o from the direction d, and its alpha.
vec4 path_radiance(Sampler rng, vec3 o, vec3 d, Medium medium) {
    vec4 sum = vec4(0.0);
    bool cut = false, again;
    uint turns = 0u;
    do {
        Path path = path_follow(rng, o, d, medium, turns);
        sum += path_finish(path);
        cut = cut || path_was_cut;
        again = hues_again(path.hues, ++turns) && !path_was_lost;
    } while (again);
    path_was_cut = cut;
    return sum / float(turns);
}
