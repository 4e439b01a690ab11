// A path: its next ray, the hit of that ray, and the step from a surface to the next ray.
struct Path {
    vec3 o;               // the ray that comes next, or came last
    vec3 d;
    Hit hit;              // of this ray; hit.id is NONE where it hits nothing
    SurfacePoint at;      // there; before the ray is traced: where it begins
    vec3 throughput;
    vec3 radiance;        // found so far
    vec3 radiance_before; // found before the last bounce
    float alpha;          // 1 where the camera sees a surface, or a background that is shown
    uint bounce;
    bool alive;           // there is a ray to follow, and after that something to scatter at
    uint event;           // what has ended the ray (path/event.glsl); before the ray is traced: the one before
    // Light that is found along d is weighted by d's density per solid angle; `counts` says whether it is added at all.
    // `lit` is the surface where d begins, as its lights were sampled.
    float found_pdf;
    bool counts;
    LightContext lit;
    // Since then the path may have gone straight through surfaces (path/straight.glsl): so far, in metres. `passed` counts
    // all such surfaces of the path, whose light is not clamped because of them.
    float travelled;
    uint passed;
    // The square of the refractive index here over that at the camera. Radiance over this square passes a boundary
    // unchanged; the factor is not part of the throughput, so that roulette does not see it.
    float eta_scale;
    Medium medium;
#if HAS_WALKS
    bool walks;     // under a surface: path/walk.glsl
    uint walked;    // how often it did so
    uint steps;     // of this walk
    uint walk_shape; // whose surface it is
    Medium outside; // of that surface
#endif
#if HAS_SCATTERING
    float distance_u; // what is left of the random number that decides on the next particle
#endif
    Cone cone;
    Hues hues;
#if HAS_FILTER_GLOSSY
    bool spread; // an event was not perfectly specular
#endif
#if CAUSTICS
    bool caustic; // so far it is a caustic's: see path/caustics.glsl
#endif
};
#include "path/caustics.glsl"
#include "path/filter_glossy.glsl"

// A throughput below this may end the path by chance. It is below 1 because the variance of ended paths costs more than
// the time that they would take: with 1/2 the error after equal time is a sixth less in a white box, a third less with
// glass.
const float ROULETTE_THRESHOLD = 0.5;
// The density of a direction that a perfectly specular lobe gave, in place of infinity.
const float PDF_DELTA = 1e30;

vec3 path_clamp(vec3 c, bool indirect) {
#if HAS_CLAMP
    float m = max_component(c);
    if (indirect && m > uniforms.clamp_radiance) c *= uniforms.clamp_radiance / m;
#endif
    return c;
}

// Russian roulette: ends paths that carry little by chance, and scales up those that survive.
void path_roulette(Sampler rng, uint pair, float reach, inout Path path) {
    if (path.bounce >= uniforms.roulette_depth && path.bounce < uniforms.max_bounces) {
        float survive = min(1.0, reach / ROULETTE_THRESHOLD);
        if (sobol_pair(rng, pair + PAIR_ROULETTE).x >= survive) path.alive = false;
        path.throughput /= survive > 0.0 ? survive : 1.0;
    }
}

// Gives the path the cone that goes on from the surface.
void path_widen(BsdfSample next, Surface s, inout Path path) {
#if ANY_FOOTPRINTS
    float eta = 1.0;
    bool crosses = false;
#if ANY_TRANSMITS
    eta = s.eta;
    crosses = next.side < 0.0;
#endif
    Cone cone = cone_bent(path.cone, dot(path.at.ng, path.d) < 0.0 ? path.at.bend : -path.at.bend, eta, crosses);
    if (!next.is_delta) cone = cone_scattered(cone, next.scatter.pdf);
    path.cone = cone;
#endif
}

// Takes the path on in the direction `next`. Where a light is sampled 1 / share times (path/direct.glsl), the density of
// finding it by chance counts only that share.
void path_extend(BsdfSample next, float share, Surface s, Sampler rng, inout Path path) {
    path.alive = next.valid;
    path_widen(next, s, path);
    path.o = terminator_leave(path.at, next.d);
    path.at.flat_id = terminator_skip(path.at, next.d);
    path.d = next.d;
    if (next.straight) {
        path.travelled += path.hit.t;
        path.passed++;
    } else {
        path.travelled = 0.0;
        path.found_pdf = next.is_delta ? PDF_DELTA : share * next.scatter.pdf;
        path.counts = ESTIMATOR != ESTIMATOR_LIGHT || next.is_delta;
    }
    path.throughput *= next.scatter.f / (path.alive ? next.scatter.pdf : 1.0);
    float reach = max_component(path.throughput);
    path.alive = path.alive && (reach > 0.0 || isnan(reach));
    // Asked for by name: GPUs take the number of max(NaN, 1), and NVIDIA's compiler makes of !(a < b) an a >= b.
    if (path.alive && (any(isnan(path.throughput)) || reach >= 1e6)) {
        atomicAdd(path_ended, 1u);
        path.alive = false;
    }
    uint pair = sobol_bounce_pair(path.bounce);
    caustics_note(next.is_delta, path);
    filter_glossy_note(next.is_delta, path);
    path.bounce++;
    path_roulette(rng, pair, reach, path);
    path.eta_scale = sides_eta_scale(path.eta_scale, next.side, s, 0.0);
}

// Adds the light from infinity, where the path has left the scene. A path does so at most once: path_finish calls this when
// all neighbouring lanes have ended, too.
void path_add_escaped(inout Path path) {
#if HAS_ENVIRONMENT || HAS_SUN_DISKS
    vec3 arriving = found_light_outside(path.d, path.found_pdf, path.bounce > 0u, caustics_leave_out(path)) * max(path.eta_scale, 1.0);
    bool shows = path.event == EVENT_ESCAPE && path.counts && (path.bounce > 0u || found_light_background());
    if (shows) path.radiance += path_clamp(path.throughput * arriving, path.bounce > 1u + path.passed);
#endif
}
