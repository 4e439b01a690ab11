// A path, and its step from the surface where it is scattered to the next hit.
struct Path {
    vec3 d;
    Hit hit;              // what d meets; hit.id is NONE where it meets nothing
    SurfacePoint at;      // there
    vec3 throughput;
    vec3 radiance;        // found so far
    vec3 radiance_before; // found before the last bounce
    uint bounce;
    bool alive;           // there is a surface to scatter at
    // Light that is found along d is weighted by d's density per solid angle; `counts` says whether it is added at all.
    float found_pdf;
    bool counts;
    // The path has left the scene. It does so at most once, so that light from infinity is added once, by path_finish,
    // when all neighbouring lanes have ended, too.
    bool escaped;
    // The square of the refractive index here over that at the camera. Radiance over this square passes a boundary
    // unchanged; the factor is not part of the throughput, so that roulette does not see it.
    float eta_scale;
    Medium medium;
};

// A throughput below this may end the path by chance. It is below 1 because the variance of ended paths costs more than
// the time that they would take: with 1/2 the error after equal time is a sixth less in a white box, a third less with
// glass.
const float ROULETTE_THRESHOLD = 0.5;
// The density of a direction that a perfectly specular lobe gave, in place of infinity.
const float PDF_DELTA = 1e30;

vec3 path_clamp(vec3 c, bool indirect) {
#if HAS_CLAMP
    float m = max_component(c);
    if (indirect && m > frame.clamp_radiance) c *= frame.clamp_radiance / m;
#endif
    return c;
}

// Russian roulette: ends paths that carry little by chance, and scales up those that survive.
void path_roulette(Sampler rng, uint pair, float reach, inout Path path) {
    if (path.bounce >= frame.roulette_depth && path.bounce < frame.max_bounces) {
        float survive = min(1.0, reach / ROULETTE_THRESHOLD);
        if (sobol_pair(rng, pair + PAIR_ROULETTE).x >= survive) path.alive = false;
        path.throughput /= survive > 0.0 ? survive : 1.0;
    }
}

// Finds what the ray from o meets.
void path_trace(vec3 o, uint skip, Sampler rng, inout Path path) {
    path.hit.id = NONE;
#if HAS_OPACITY
    if (path.alive) path.hit = transparency_nearest(o, path.d, skip, path.bounce, rng, path.at);
#else
    if (path.alive) path.hit = shapes_nearest(o, path.d, skip);
    path.at = shapes_point(path.hit, o, path.d);
#endif
}

// Takes the path on to the nearest surface in the direction `next`. Where a light is sampled 1 / share times
// (direct.glsl), the density of finding it by chance counts only that share.
void path_extend(BsdfSample next, float share, Surface s, Sampler rng, inout Path path) {
    path.alive = next.valid;
    path.d = next.d;
    path.found_pdf = next.is_delta ? PDF_DELTA : share * next.scatter.pdf;
    path.counts = ESTIMATOR != ESTIMATOR_LIGHT || next.is_delta;
    path.throughput *= next.scatter.f / (path.alive ? next.scatter.pdf : 1.0);
    float reach = max_component(path.throughput);
    path.alive = path.alive && reach > 0.0;
    if (path.alive && !(reach < 1e6)) {
        atomicAdd(path_ended, 1u); // a throughput that is huge or NaN
        path.alive = false;
    }
    uint pair = sobol_bounce_pair(path.bounce);
    path.bounce++;
    path_roulette(rng, pair, reach, path);
    path.eta_scale = facing_eta_scale(path.eta_scale, next.side, s, 0.0);
    path_trace(shapes_leave(path.at, next.d), path.at.flat_id, rng, path);
    path.throughput *= medium_share(path.medium, path.hit.t);
    bool met = path.hit.id != NONE;
    path.escaped = path.alive && !met && path.counts;
    path.alive = path.alive && met;
}

// Adds the ambient light of the surface that the path has come to, and its emission times `weight`.
void path_add_emission(float weight, inout Path path) {
#if HAS_EMISSION
    vec3 arriving = arriving_emission(path.at, path.d) * weight * path.eta_scale;
    if (path.alive) path.radiance += path_clamp(path.throughput * arriving, path.bounce > 1u);
#endif
#if HAS_AMBIENT
    vec3 ambient = arriving_ambient(path.at) * path.eta_scale;
    if (path.alive) path.radiance += path_clamp(path.throughput * ambient, path.bounce > 1u);
#endif
}

// Adds the light from infinity, where the path has left the scene.
void path_add_escaped(inout Path path) {
#if HAS_ENVIRONMENT || HAS_SUN_DISKS
    vec3 arriving = arriving_outside(path.d, path.found_pdf, path.bounce > 0u) * max(path.eta_scale, 1.0);
    if (path.escaped) path.radiance += path_clamp(path.throughput * arriving, path.bounce > 1u);
#endif
}
