// The material models: which lobes each of them has, and with what weights. Directions are in the shading frame.
#include "bsdf/lobe.glsl"
#include "math/fresnel.glsl"
#include "bsdf/ggx.glsl"
#include "bsdf/lobes/lambert.glsl"
#include "bsdf/lobes/disney/diffuse.glsl"
#include "bsdf/lobes/disney/sheen.glsl"
#include "bsdf/lobes/disney/specular.glsl"
#include "bsdf/lobes/disney/clearcoat.glsl"
#include "bsdf/lobes/metal_rough.glsl"
#include "bsdf/lobes/blinn_phong.glsl"
#include "bsdf/lobes/phong.glsl"
#include "bsdf/lobes/microfacet/precise.glsl"
#include "bsdf/lobes/microfacet/distribution.glsl"
#include "bsdf/lobes/microfacet/geometry.glsl"
#include "bsdf/lobes/microfacet/fresnel.glsl"
#include "bsdf/lobes/microfacet/diffuse.glsl"
#include "bsdf/lobes/microfacet/model.glsl"
#include "bsdf/energy.glsl"
#include "bsdf/lobes/principled/diffuse.glsl"
#include "bsdf/lobes/principled/sheen_charlie.glsl"
#include "bsdf/lobes/principled/clearcoat.glsl"
#include "bsdf/lobes/principled/multiscatter.glsl"
#include "bsdf/lobes/principled/microfacet.glsl"

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
    bool valid;    // false: the path ends
};

struct LobeWeights {
    float diffuse;
    float specular;
    float clearcoat;
};

// The chances of picking each lobe; they sum to one.
LobeWeights bsdf_weights(Surface s, vec3 wo) {
    LobeWeights w = LobeWeights(1.0, 0.0, 0.0);
#if HAS_DISNEY
    if (s.model == MODEL_DISNEY) {
        w = LobeWeights(disney_diffuse_weight(s), disney_specular_weight(s, wo), 0.0);
#if HAS_CLEARCOAT
        w.clearcoat = disney_clearcoat_weight(s, wo);
#endif
        float inv = 1.0 / (w.diffuse + w.specular + w.clearcoat);
        w = LobeWeights(w.diffuse * inv, w.specular * inv, w.clearcoat * inv);
    }
#endif
    return w;
}

// Into the specular lobe's own frame, whose x is the tangent, and back.
vec3 bsdf_turn(Surface s, vec3 w) {
    return vec3(dot(s.tangent, w.xy), s.tangent.x * w.y - s.tangent.y * w.x, w.z);
}

vec3 bsdf_turn_back(Surface s, vec3 w) {
    return vec3(s.tangent.x * w.x - s.tangent.y * w.y, s.tangent.y * w.x + s.tangent.x * w.y, w.z);
}

#include "bsdf/principled.glsl"

Scatter bsdf_eval(Surface s, vec3 wo, vec3 wi) {
#if HAS_TRANSMISSION
    bool below = s.model == MODEL_PRINCIPLED && wi.z < 0.0;
    if (wo.z <= 0.0 || (wi.z <= 0.0 && !below)) return Scatter(vec3(0.0), 0.0);
#else
    if (wo.z <= 0.0 || wi.z <= 0.0) return Scatter(vec3(0.0), 0.0);
#endif
    Scatter r = Scatter(LOBE(LOBE_DIFFUSE, lambert_eval(s)), lambert_pdf(wi));
#if HAS_DISNEY
    if (s.model == MODEL_DISNEY) {
        LobeWeights w = bsdf_weights(s, wo);
        vec3 wm = normalize(wo + wi);
        float cos_d = dot(wi, wm);
        r.f = LOBE(LOBE_DIFFUSE, disney_diffuse_eval(s, wo, wi, cos_d));
        r.pdf = w.diffuse * lambert_pdf(wi);
#if HAS_SHEEN
        r.f += LOBE(LOBE_SHEEN, disney_sheen_eval(s, cos_d));
#endif
        vec3 wm_t = wm, wo_t = wo;
#if HAS_ANISOTROPIC
        wm_t = bsdf_turn(s, wm);
        wo_t = bsdf_turn(s, wo);
#endif
        r.f += LOBE(LOBE_SPECULAR, disney_specular_eval(s, wo, wi, wm_t, cos_d));
        r.pdf += w.specular * disney_specular_pdf(s, wo_t, wm_t);
#if HAS_CLEARCOAT
        r.f += LOBE(LOBE_CLEARCOAT, disney_clearcoat_eval(s, wo, wi, wm, cos_d));
        r.pdf += w.clearcoat * disney_clearcoat_pdf(s, wm, cos_d);
#endif
    }
#endif
#if HAS_METAL_ROUGH
    if (s.model == MODEL_METAL_ROUGH) {
        vec3 wm = normalize(wo + wi);
        r = Scatter(metal_rough_eval(s, wo, wi, wm, dot(wi, wm)), metal_rough_pdf(s, wo, wi, wm));
    }
#endif
#if HAS_BLINN_PHONG
    if (s.model == MODEL_BLINN_PHONG) {
        vec3 wm = normalize(wo + wi);
        r = Scatter(blinn_phong_eval(s, wi, wm), blinn_phong_pdf(s, wi, wm, dot(wi, wm)));
    }
#endif
#if HAS_PHONG
    if (s.model == MODEL_PHONG) r = Scatter(phong_eval(s, wo, wi), phong_pdf(s, wo, wi));
#endif
#if HAS_MICROFACET
    if (s.model == MODEL_MICROFACET) {
        vec3 sum = wo + wi;
        float cos_d = 0.5 * length(sum); // a dot product would cancel at grazing angles
        vec3 wm = sum / (2.0 * cos_d);
        r = Scatter(microfacet_model_eval(s, wo, wi, wm, cos_d), microfacet_model_pdf(s, wo, wi, wm, cos_d));
    }
#endif
#if HAS_PRINCIPLED_LOBES
    if (s.model == MODEL_PRINCIPLED) r = principled_eval(s, wo, wi);
#endif
#if HAS_TRANSMISSION
    r.f *= abs(wi.z);
#else
    r.f *= wi.z;
#endif
    return r;
}

LobeSample bsdf_sample(Surface s, vec3 wo, float u_lobe, vec2 u) {
    vec3 wi = lambert_sample(u);
#if HAS_DISNEY
    if (s.model == MODEL_DISNEY) {
        LobeWeights w = bsdf_weights(s, wo);
        vec3 wo_t = wo;
#if HAS_ANISOTROPIC
        wo_t = bsdf_turn(s, wo);
#endif
        vec3 mirrored = disney_specular_sample(s, wo_t, u);
#if HAS_ANISOTROPIC
        mirrored = bsdf_turn_back(s, mirrored);
#endif
        if (u_lobe >= w.diffuse) wi = mirrored;
#if HAS_CLEARCOAT
        vec3 coat = disney_clearcoat_sample(s, wo, u);
        if (u_lobe >= w.diffuse + w.specular) wi = coat;
#endif
    }
#endif
#if HAS_METAL_ROUGH
    if (s.model == MODEL_METAL_ROUGH) wi = metal_rough_sample(s, wo, u_lobe, u);
#endif
#if HAS_BLINN_PHONG
    if (s.model == MODEL_BLINN_PHONG) wi = blinn_phong_sample(s, wo, u_lobe, u);
#endif
#if HAS_PHONG
    if (s.model == MODEL_PHONG) wi = phong_sample(s, wo, u_lobe, u);
#endif
#if HAS_MICROFACET
    if (s.model == MODEL_MICROFACET) wi = microfacet_model_sample(s, wo, u_lobe, u);
#endif
    LobeSample r = LobeSample(wi, false, Scatter(vec3(0.0), 0.0), false);
#if HAS_PRINCIPLED_LOBES
    if (s.model == MODEL_PRINCIPLED) r = principled_sample(s, wo, u_lobe, u);
#endif
    return r;
}

// Samples uniformly over the hemisphere, or over the sphere where the material transmits; perfectly specular lobes are
// sampled as always. Of a uniform direction `scatter` has only the density.
LobeSample bsdf_sample_uniform(Surface s, vec3 wo, float u_lobe, vec2 u) {
    LobeSample r = bsdf_sample(s, wo, u_lobe, u);
    if (!r.is_delta) {
        r.coated = false;
        r.wi = sampling_hemisphere(u);
        r.scatter.pdf = 0.5 * INV_PI;
#if HAS_PRINCIPLED_LOBES
        float rest = s.model == MODEL_PRINCIPLED ? 1.0 - principled_delta_chance(s, wo) : 1.0;
#if HAS_TRANSMISSION
        if (s.model == MODEL_PRINCIPLED && s.transmission > 0.0) {
            r.wi = sampling_sphere(u);
            r.scatter.pdf *= 0.5;
        }
#endif
        r.scatter.pdf *= rest;
#endif
    }
    return r;
}
