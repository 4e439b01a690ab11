// What a surface does to light, whatever its model: `models.glsl`, which is no file, picks the functions of the model
// (gpu/kernels/models_glsl.py). Directions are in the shading frame.
#include "material/surface.glsl"
#include "bsdf/lobe.glsl"
#include "math/fresnel.glsl"
#include "bsdf/ggx.glsl"

struct Scatter {
    vec3 f;    // BSDF times |cos theta_i|
    float pdf; // with which bsdf_sample gives this wi, per solid angle
};

// A sampled direction in the shading frame. It may lie below the surface, where bsdf_eval gives pdf 0.
struct LobeSample {
    vec3 wi;
    bool is_delta;   // a perfectly specular lobe gave it ...
    Scatter scatter; // ... whose reflectance and chance these are
    bool coated;     // the coat gave it, which reflects even where wi lies below the base's normal
};

// The direction in world space that a path goes on to.
struct BsdfSample {
    vec3 d;
    Scatter scatter;
    float side;    // its sign says on which side of the surface d is
    bool is_delta; // a perfectly specular lobe gave it
    bool enters;   // it goes on to walk under the surface
    bool straight; // that of a surface that light goes straight through
    bool valid;    // false: the path ends
};

// The terms of a model of microfacets for one normal of a facet.
struct Terms {
    vec3 f;           // reflectance of the facet
    float d;          // density of facets, 1/sr
    float visibility; // the share that is neither masked nor shadowed, over 4 cos cos
    bool has_facets;  // false: a perfect mirror
};

// The type of a share of light that depends on the boundary of bsdf/lobes/base: a colour where a film may lie on it.
#if HAS_FILM
#define BASE_SHARE vec3
#else
#define BASE_SHARE float
#endif

float base_grey(float share) { return share; }
float base_grey(vec3 share) { return luminance(share); }

const int BSDF_DELTAS = 3; // perfectly specular lobes that a surface has at most

// A sample of lobes that are not perfectly specular.
LobeSample bsdf_rough_sample(vec3 wi) { return LobeSample(wi, false, Scatter(vec3(0.0), 0.0), false); }

#if HAS_WALKS
// The sample of light that enters straight, to walk under the surface: f is the share that does, of the chance `pdf`. It
// is told from others by having no lobe of its own.
LobeSample bsdf_entering(vec3 wo, vec3 f, float pdf) { return LobeSample(-wo, false, Scatter(f, pdf), true); }
#endif

bool bsdf_enters(LobeSample r) {
#if HAS_WALKS
    return !r.is_delta && r.coated && r.scatter.pdf > 0.0;
#else
    return false;
#endif
}

// Into the specular lobe's own frame, whose x is the tangent, and back.
vec3 bsdf_turn(Surface s, vec3 w) {
    return vec3(dot(s.tangent, w.xy), s.tangent.x * w.y - s.tangent.y * w.x, w.z);
}

vec3 bsdf_turn_back(Surface s, vec3 w) {
    return vec3(s.tangent.x * w.x - s.tangent.y * w.y, s.tangent.y * w.x + s.tangent.x * w.y, w.z);
}

#include "models.glsl"

// A material as a surface, but for what depends on wo, which models_face sets.
Surface surface_make(Material m, vec2 tangent) {
    Surface s = surface_plain(m);
    models_surface(m, tangent, s);
    return s;
}

#include "bsdf/phase.glsl"

// The f of the models' own functions lacks the cosine.
Scatter bsdf_eval(Surface s, vec3 wo, vec3 wi) {
#if HAS_SCATTERING
    if (event_is_particle(s.event)) return phase_eval(s.g, wo, wi);
#endif
#if HAS_WALKS
    if (event_is_exit(s.event))
        return wi.z > 0.0 ? Scatter(models_left(s, wi) * (INV_PI * wi.z), INV_PI * wi.z) : Scatter(vec3(0.0), 0.0);
#endif
#if HAS_TRANSMISSION
    bool below = model_transmits(s.model) && wi.z < 0.0;
    if (wo.z <= 0.0 || (wi.z <= 0.0 && !below)) return Scatter(vec3(0.0), 0.0);
#else
    if (wo.z <= 0.0 || wi.z <= 0.0) return Scatter(vec3(0.0), 0.0);
#endif
    Scatter r = models_eval(s, wo, wi);
#if HAS_TRANSMISSION
    r.f *= abs(wi.z);
#else
    r.f *= wi.z;
#endif
    return r;
}

LobeSample bsdf_sample(Surface s, vec3 wo, float u_lobe, vec2 u) {
    LobeSample r = models_sample(s, wo, u_lobe, u);
#if HAS_SCATTERING
    if (event_is_particle(s.event)) r = bsdf_rough_sample(phase_sample(s.g, u));
#endif
    if (event_is_exit(s.event)) r = bsdf_rough_sample(sampling_cosine(u));
    return r;
}

// Makes a sample of bsdf_sample one that is uniform over the hemisphere, or over the sphere where the material transmits;
// those of perfectly specular lobes stay as they are. Of a uniform direction `scatter` has only the density.
void bsdf_make_uniform(Surface s, vec3 wo, vec2 u, inout LobeSample r) {
    if (!r.is_delta && !bsdf_enters(r)) {
        r.coated = false;
        r.wi = sampling_hemisphere(u);
        r.scatter.pdf = 0.5 * INV_PI;
#if HAS_TRANSMISSION
        bool through = s.transmission > 0.0;
#if HAS_THIN_WALLS
        through = through || s.diffuse_transmission > 0.0;
#endif
        through = through && !event_is_exit(s.event);
        if (model_transmits(s.model) && through) {
            r.wi = sampling_sphere(u);
            r.scatter.pdf *= 0.5;
        }
#endif
        r.scatter.pdf *= 1.0 - models_delta_chance(s, wo);
        if (event_is_exit(s.event)) r.scatter.pdf = 0.5 * INV_PI;
        if (event_is_particle(s.event)) {
            r.wi = sampling_sphere(u);
            r.scatter.pdf = 0.25 * INV_PI;
        }
    }
}

// The perfectly specular lobes of a surface, each as bsdf_sample gives it; those that it lacks have the chance 0. The
// coat and the base may mirror into the same direction.
void bsdf_deltas(Surface s, vec3 wo, out LobeSample deltas[BSDF_DELTAS]) {
    for (int k = 0; k < BSDF_DELTAS; k++) deltas[k] = bsdf_rough_sample(vec3(0.0));
    models_deltas(s, wo, deltas);
}
