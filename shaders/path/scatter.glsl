// Scattering in media. A path that meets a particle before it comes to a surface turns there: `path.at` is that place, and
// the phase function of Henyey and Greenstein [1941] takes the place of the BSDF, whose frame has wo as its z.

#include "path/walk.glsl"
#include "path/equiangular.glsl"

void scatter_begin(inout Path path) {
#if HAS_SCATTERING
    path.distance_u = 0.0;
#endif
}

#if HAS_SCATTERING
const uint SCATTER_ID = NONE - 1u; // in place of the id of a shape

// Samples how far the ray goes before something scatters it; true where it does. The distance is drawn by the extinction of one channel, chosen as the throughput has
// it, or towards a lamp, weighted by the balance heuristic over all. Where it gets through, what is left of `u` decides
// on what follows.
bool scatter_distance(float u, inout Path path) {
    const float BELOW_1 = 1.0 - 1.0 / 16777216.0;
    float aimed = 0.0; // the chance that the distance is drawn towards a lamp
    bool aims = false;
#if ANY_EQUIANGULAR
    Equiangular e = equiangular_make(path.o, path.d, path.hit.t, dot(path.medium.rate, vec3(1.0 / 3.0)));
    if (walk_goes_on(path)) e.chances = vec4(0.0); // no lamp is sampled there
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
    bool scattered = (aims || t < path.hit.t) && max_component(path.medium.scattering) > 0.0;
    t = min(t, path.hit.t);
    vec3 share = exp(-rate * t), weight = share, pdfs = share;
    if (scattered) {
        weight *= path.medium.scattering;
        pdfs *= rate;
    }
    float pdf = (1.0 - aimed) * dot(chance, pdfs);
#if ANY_EQUIANGULAR
    if (scattered && aimed > 0.0) pdf += equiangular_pdf(e, t);
#endif
    path.throughput *= pdf > 0.0 ? weight / pdf : vec3(0.0);
    path.hit.t = t;
    float chance_left = exp(-rate[channel] * t); // of coming so far
    path.distance_u = clamp((u - (1.0 - chance_left)) / max(chance_left, 1e-30), 0.0, BELOW_1);
    return scattered;
}
#endif

// Takes the path along its ray, as far as its medium lets it; true where that ends it at a particle.
bool scatter_travel(Sampler rng, inout Path path) {
#if HAS_GLOWING_MEDIA
    // What the whole ray collects is added even where the path turns on the way: that is its mean.
    vec3 depth = path.medium.rate * path.hit.t;
    vec3 length = mix((1.0 - exp(-depth)) / max(path.medium.rate, vec3(1e-30)), vec3(path.hit.t), lessThan(depth, vec3(1e-4)));
    vec3 emission = path.medium.emission * length * path.throughput * path.eta_scale;
    if (path.alive) path.radiance += path_clamp(emission, path.bounce > 1u + path.passed);
#endif
#if HAS_SCATTERING
    bool scattered = false;
    float u = sobol_pair(rng, sobol_bounce_pair(path.bounce) + PAIR_ROULETTE).y;
#if HAS_PRIORITIES // else only walks pass surfaces, and have numbers of their own
    if (event_is_passage(path.event)) u = path.distance_u;
#endif
    if (walk_goes_on(path)) u = walk_random(rng, path, 0u);
    if (path.alive && max_component(path.medium.scattering) > 0.0) scattered = scatter_distance(u, path);
    else path.throughput *= medium_share(path.medium, path.hit.t);
    if (scattered) {
        path.at = shapes_none(path.o + path.hit.t * path.d, -path.d);
        path.hit.id = SCATTER_ID;
    }
    return scattered;
#else
    path.throughput *= medium_share(path.medium, path.hit.t);
    return false;
#endif
}

// Describes the place where something else than a surface scatters.
void scatter_interaction(Path path, inout Interaction here) {
#if HAS_SCATTERING
    here.g = path.medium.forward / max(dot(path.medium.scattering, vec3(1.0 / 3.0)), 1e-30);
    if (event_is_particle(path.event)) {
        here.front = here.fold = here.facing = -path.d;
        here.basis = basis_make(-path.d);
        here.wo = vec3(0.0, 0.0, 1.0);
        here.behind = here.mapped = false;
        here.transmits = true;
    }
#endif
    walk_interaction(path, here);
}

// Tells the surface what scatters in its place.
void scatter_surface(Interaction here, inout Surface s) {
#if HAS_SCATTERING
    s.event = here.event;
    s.g = here.g;
#if HAS_WALKS
    if (here.behind) s.walks = 0.0; // it is entered from outside
#endif
#if ANY_TRANSMITS
    if (event_is_particle(here.event)) s.eta = 1.0;
#endif
#endif
}
