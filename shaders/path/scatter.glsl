// Scattering in media. A path that meets a particle before it comes to a surface turns there: `path.at` is that place, and
// the phase function of Henyey and Greenstein [1941] takes the place of the BSDF, whose frame has wo as its z.

#include "path/walk.glsl"
#include "path/equiangular.glsl"

// Whether the ray has come to a boundary that is not there.
bool path_passes(Path path) {
#if HAS_PRIORITIES
    return path.passes;
#else
    return false;
#endif
}

// Whether the path has met a particle at the end of its ray.
bool scatter_was(Path path) {
#if HAS_SCATTERING
    return path.in_medium;
#else
    return false;
#endif
}

#if HAS_SCATTERING
const uint SCATTER_ID = NONE - 1u; // in place of the id of a shape

// Samples how far the ray goes before something scatters it: by the extinction of one channel, chosen as the throughput has
// it, or towards a lamp, weighted by the balance heuristic over all. Where it gets through, what is left of `u` decides
// on what follows.
void scatter_distance(float u, inout Path path) {
    const float BELOW_1 = 1.0 - 1.0 / 16777216.0;
    float aimed = 0.0; // the chance that the distance is drawn towards a lamp
    bool aims = false;
#if ANY_EQUIANGULAR
    Equiangular e = equiangular_make(path.o, path.d, path.hit.t, dot(path.medium.rate, vec3(1.0 / 3.0)));
#if HAS_WALKS
    if (path.walks) e.chances = vec4(0.0); // no lamp is sampled there
#endif
    aimed = equiangular_chance(e);
    aims = u < aimed;
    float t_aimed = equiangular_sample(e, u);
    if (!aims) u = clamp((u - aimed) / (1.0 - aimed), 0.0, BELOW_1);
#endif
    vec3 chance = path.throughput / (path.throughput.x + path.throughput.y + path.throughput.z);
    uint channel = u < chance.x ? 0u : u < chance.x + chance.y ? 1u : 2u;
    float before = channel == 0u ? 0.0 : channel == 1u ? chance.x : chance.x + chance.y;
    vec3 rate = path.medium.rate;
    u = clamp((u - before) / chance[channel], 0.0, BELOW_1);
    float t = -log(1.0 - u) / max(rate[channel], 1.0 / INFINITY_T);
#if ANY_EQUIANGULAR
    if (aims) t = t_aimed;
#endif
    path.in_medium = (aims || t < path.hit.t) && max_component(path.medium.scattering) > 0.0;
    t = min(t, path.hit.t);
    vec3 share = exp(-rate * t), weight = share, pdfs = share;
    if (path.in_medium) {
        weight *= path.medium.scattering;
        pdfs *= rate;
    }
    float pdf = (1.0 - aimed) * dot(chance, pdfs);
#if ANY_EQUIANGULAR
    if (path.in_medium && aimed > 0.0) pdf += equiangular_pdf(e, t);
#endif
    path.throughput *= pdf > 0.0 ? weight / pdf : vec3(0.0);
    path.hit.t = t;
    float chance_left = exp(-rate[channel] * t); // of coming so far
    path.distance_u = clamp((u - (1.0 - chance_left)) / max(chance_left, 1e-30), 0.0, BELOW_1);
}
#endif

// Takes the path along its ray, as far as its medium lets it.
void scatter_travel(Sampler rng, inout Path path) {
    vec3 emission = vec3(0.0);
#if HAS_GLOWING_MEDIA
    // What the whole ray collects is added even where the path turns on the way: that is its mean.
    vec3 depth = path.medium.rate * path.hit.t;
    vec3 length = mix((1.0 - exp(-depth)) / max(path.medium.rate, vec3(1e-30)), vec3(path.hit.t), lessThan(depth, vec3(1e-4)));
    emission = path.medium.emission * length * path.throughput * path.eta_scale;
    if (path.alive) path.radiance += path_clamp(emission, path.bounce > 1u + path.passed);
#endif
#if HAS_SCATTERING
    path.in_medium = false;
    float u = sobol_pair(rng, sobol_bounce_pair(path.bounce) + PAIR_ROULETTE).y;
#if HAS_PRIORITIES
    if (path.passes) u = path.distance_u;
#endif
#if HAS_WALKS
    if (path.walks) u = walk_random(rng, path, 0u);
#endif
    if (path.alive && max_component(path.medium.scattering) > 0.0) scatter_distance(u, path);
    else path.throughput *= medium_share(path.medium, path.hit.t);
    if (path.in_medium) {
        path.at = shapes_none(path.o + path.hit.t * path.d, -path.d);
        path.hit.id = SCATTER_ID;
    }
#else
    path.throughput *= medium_share(path.medium, path.hit.t);
#endif
}

// Describes the place, if there is no surface.
void scatter_interaction(Path path, inout Interaction here) {
#if HAS_SCATTERING
    here.in_medium = path.in_medium;
    here.g = path.medium.forward / max(dot(path.medium.scattering, vec3(1.0 / 3.0)), 1e-30);
    if (path.in_medium) {
        here.front = here.fold = here.facing = -path.d;
        here.basis = basis_make(-path.d);
        here.wo = vec3(0.0, 0.0, 1.0);
        here.behind = here.mapped = false;
        here.transmits = true;
    }
#endif
#if HAS_WALKS
    walk_interaction(path, here);
#endif
}

// Gives the surface the phase function, if there is none.
void scatter_surface(Interaction here, inout Surface s) {
#if HAS_SCATTERING
    s.in_medium = here.in_medium;
    s.g = here.g;
#if HAS_WALKS
    s.exits = here.exits;
    if (here.behind) s.walks = 0.0; // it is entered from outside
#endif
#if ANY_TRANSMITS
    if (here.in_medium) s.eta = 1.0;
#endif
#endif
}
