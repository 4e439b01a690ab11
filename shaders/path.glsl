// The estimator: the light that reaches the camera along one path. interaction.glsl says what a path meets, direct.glsl
// adds what the lights send there, bsdf_world.glsl picks the next direction and path_extend.glsl goes there.
#include "surface.glsl"
#include "bsdf.glsl"
#include "lights.glsl"
#include "transparency.glsl"
#include "medium.glsl"
#include "arriving.glsl"
#include "facing.glsl"
#include "path_extend.glsl"
#include "interaction.glsl"
#include "normal_map.glsl"
#include "bsdf_world.glsl"
#include "direct.glsl"
#include "delta_chain.glsl"

bool path_was_cut; // the driver has ended the last path before its time

// Begins a path that leaves the camera along d and meets `hit` first. Returns its alpha: 1 where it meets a surface or
// a background that is shown.
float path_begin(vec3 d, Hit hit, SurfacePoint at, Medium medium, out Path path) {
    bool met = hit.id != NONE;
    path.d = d;
    path.hit = hit;
    path.at = at;
    path.medium = medium;
    path.throughput = medium_share(medium, hit.t);
    path.eta_scale = 1.0;
    path.found_pdf = PDF_DELTA;
    path.counts = true;
    path.escaped = !met && arriving_background();
    path.bounce = 0u;
    path.alive = met && frame.max_bounces > 0u;
    path.radiance = vec3(0.0);
    if (met) path.radiance = arriving_emission(at, d) + arriving_ambient(at);
    path.radiance *= path.throughput;
    path.radiance_before = path.radiance;
    return met || path.escaped ? 1.0 : 0.0;
}

// Ends a path: adds what it finds at infinity, where it has left the scene.
vec3 path_finish(Path path) {
    path_add_escaped(path);
    // llvmpipe ends every loop of an invocation after 65 535 turns in all, without an error. The last hit of such a
    // path may be wrong.
    path_was_cut = path.alive && path.bounce < frame.max_bounces;
    return path_was_cut ? path.radiance_before : path.radiance;
}

// The radiance that a path finds from its first surface to its end.
vec3 path_radiance(Sampler rng, Path path) {
    if (path.alive) {
        do {
            Interaction here;
            Material m;
            if (delta_chain(rng, path, here, m)) break;
            Surface s = interaction_surface(here, m);
            LightContext context = direct_context(path.at, here.front, here.facing, here.transmits);
            float share = direct_share(s, path.bounce);
            direct_lighting(s, here, context, share, rng, path);
            BsdfSample next = bsdf_sample_world(s, here, rng, path.bounce);
            path.medium = interaction_medium(dot(here.front, next.d) < 0.0, path.medium, here.beyond);
            path_extend(next, share, s, rng, path);
            path_add_emission(direct_found_weight(context, path), path);
        } while (path.alive && path.bounce < frame.max_bounces);
    }
    return path_finish(path);
}
