// A step of a path: from where it is scattered to what it meets next.
struct Path {
    vec3 d;
    Hit hit; // what d meets, hit.id NONE: nothing
    SurfacePoint at;  // there
    vec3 throughput;
    vec3 radiance; // light found so far
    uint bounce;
    bool alive; // there is a surface to scatter at
#if HAS_ENVIRONMENT || HAS_SUN_DISKS
    // A path leaves the scene once at most: what arrives from there is asked for once, when all its neighbours ended.
    bool escaped;
    float escaped_pdf;
#endif
#if HAS_TRANSMISSION
    // Radiance over the square of the index is what passes a boundary unchanged: `eta_scale` is that square here over
    // that at the camera, kept apart so that roulette does not see it.
    float eta_scale;
#endif
#if HAS_ATTENUATION
    Medium medium;
#endif
};

// Of a new path's throughput: a path that carries less may end by chance. Below 1, for the variance of ending paths costs
// more than the time they take: 1/2 leaves a sixth less error after equal time in a white box, a third by glass.
const float ROULETTE_THRESHOLD = 0.5;
// Stands for the density of a direction that only a mirror could have taken.
const float PDF_DELTA = 1e30;

vec3 path_clamp(vec3 c, bool indirect) {
#if HAS_CLAMP
    float m = max_component(c);
    if (indirect && m > frame.clamp_radiance) c *= frame.clamp_radiance / m;
#endif
    return c;
}

// On towards d, which was sampled with `next`, to the nearest surface. `found_pdf`: what light found there is weighed
// with; `counts`: whether it does at all; `side`: of d, in the shading frame.
void path_extend(vec3 d, Scatter next, float found_pdf, bool counts, float side, Surface s, Sampler rng,
                 inout Path path) {
    path.d = d;
    path.throughput *= next.f / (path.alive ? next.pdf : 1.0);
    float reach = max_component(path.throughput);
    path.alive = path.alive && reach > 0.0;
    if (path.alive && !(reach < 1e6)) {
        atomicAdd(path_ended, 1u);
        path.alive = false;
    }
    uint pair = PAIR_BOUNCE + path.bounce * PAIRS_A_BOUNCE, flat_id = path.at.flat_id;
    path.bounce++;
    if (path.bounce >= frame.roulette_depth && path.bounce < frame.max_bounces) {
        float survive = min(1.0, reach / ROULETTE_THRESHOLD);
        if (sobol_pair(rng, pair + PAIR_ROULETTE).x >= survive) path.alive = false;
        path.throughput /= survive > 0.0 ? survive : 1.0;
    }
    vec3 o = shapes_leave(path.at, d);
    path.hit.id = NONE;
#if HAS_TRANSMISSION
    path.eta_scale = facing_eta_scale(path.eta_scale, side, s, 0.0);
#endif
#if HAS_OPACITY
    if (path.alive) path.hit = transparency_nearest(o, d, flat_id, path.bounce, rng, path.at);
#else
    if (path.alive) path.hit = shapes_nearest(o, d, flat_id);
    path.at = shapes_point(path.hit, o, d);
#endif
#if HAS_ATTENUATION
    path.throughput *= medium_share(path.medium, path.hit.t);
#endif
    bool met = path.hit.id != NONE;
#if HAS_ENVIRONMENT || HAS_SUN_DISKS
    path.escaped = path.alive && !met && counts;
    path.escaped_pdf = found_pdf;
#endif
    path.alive = path.alive && met;
}

// What shines where the path has come to, `weight` of its emission.
void path_add_emission(float weight, inout Path path) {
#if HAS_EMISSION
    vec3 arriving = arriving_emission(path.at, path.d) * weight;
#if HAS_TRANSMISSION
    arriving *= path.eta_scale;
#endif
    if (path.alive) path.radiance += path_clamp(path.throughput * arriving, path.bounce > 1u);
#endif
#if HAS_AMBIENT
    vec3 ambient = arriving_ambient(path.at);
#if HAS_TRANSMISSION
    ambient *= path.eta_scale;
#endif
    if (path.alive) path.radiance += path_clamp(path.throughput * ambient, path.bounce > 1u);
#endif
}
