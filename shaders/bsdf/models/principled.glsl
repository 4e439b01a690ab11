// The production model: a coat over a sheen over a base that mixes metal, a diffuse material under a dielectric, and
// glass. A layer of albedo E leaves 1 - max(E(o), E(i)) of the light to what is under it, which is reciprocal and gains
// nothing [Kulla & Conty 2017, section 4]. The model departs from the 2012 course notes where those gain or lose light.
#include "bsdf/energy.glsl"
#include "bsdf/lobes/principled/diffuse.glsl"
#include "bsdf/lobes/principled/sheen_charlie.glsl"
#include "bsdf/lobes/principled/clearcoat.glsl"
#include "bsdf/lobes/principled/multiscatter.glsl"
#include "bsdf/lobes/principled/specular.glsl"

#if HAS_PRINCIPLED
// Sets the members that do not depend on the direction; principled_face sets the others.
void principled_surface(Material m, vec2 tangent, inout Surface s) {
    float largest = max_component(m.base_color);
    vec3 tint = largest > 0.0 ? m.base_color / largest : vec3(1.0);
    s.specular_color = m.specular_color * mix(vec3(1.0), tint, m.specular_tint);
    float f0 = sqrt(0.08 * m.specular);
    s.eta_outside = m.ior >= 1.0 ? m.ior : (1.0 + f0) / (1.0 - f0);
    s.index_matched = s.eta_outside < 1.0001;
    if (s.index_matched) s.eta_outside = 1.0;
    s.eta = s.eta_outside;
    s.transmission = 0.0;
    s.inside = false;
#if HAS_TRANSMISSION
    s.transmission = m.transmission;
#endif
    s.is_delta = m.roughness < LEAST_ROUGHNESS;
    s.aspect = 1.0;
#if HAS_ANISOTROPIC
    s.aspect = sqrt(1.0 - 0.9 * m.anisotropic);
    float turn = radians(m.anisotropic_rotation);
    vec2 cs = vec2(cos(turn), sin(turn));
    s.tangent = m.anisotropic > 0.0 ? vec2(cs.x * tangent.x - cs.y * tangent.y, cs.y * tangent.x + cs.x * tangent.y)
                                    : vec2(1.0, 0.0);
#endif
    float a = sqr(max(m.roughness, LEAST_ROUGHNESS));
    s.alpha = vec2(a / s.aspect, a * s.aspect);
#if HAS_SHEEN
    s.sheen = m.sheen * (m.sheen_color.x >= 0.0 ? m.sheen_color : mix(vec3(1.0), tint, m.sheen_tint));
    s.sheen *= 1.0 - m.metallic;
    s.sheen_roughness = max(m.sheen_roughness, ENERGY_LEAST_SHEEN_ROUGHNESS);
    s.alpha_sheen = s.sheen_roughness * s.sheen_roughness;
#endif
    s.coat_is_delta = false;
#if HAS_CLEARCOAT
    s.clearcoat = m.clearcoat;
    s.coat_is_delta = m.clearcoat_roughness >= 0.0 && m.clearcoat_roughness < LEAST_ROUGHNESS;
    float rough = max(m.clearcoat_roughness, LEAST_ROUGHNESS);
    s.alpha_coat = m.clearcoat_roughness >= 0.0 ? rough * rough : mix(0.1, 0.001, m.clearcoat_gloss);
    s.coat_roughness = s.coat_is_delta ? 0.0 : sqrt(s.alpha_coat);
#endif
}

// The chances of picking each lobe; they sum to one.
struct PrincipledWeights {
    float diffuse;       // diffuse light and light between microfacets that leaves above the surface
    float diffuse_below; // light between microfacets that leaves below it
    float specular;
    float sheen;
    float coat;
};

// The share of light that the layers leave to the base: between wo and wi, or by wo alone where only one is outside.
float principled_layers(Surface s, float coat_i, float sheen_i) {
    return (1.0 - max(s.coat_albedo, coat_i)) * (1.0 - max(s.sheen_albedo, sheen_i));
}

// Into the coat's own frame and back; its normal may differ from that of the base.
#if HAS_COAT_NORMALS
float principled_coat_cosine(Surface s, vec3 w) { return dot(s.coat.z, w); }
vec3 principled_coat_to_local(Surface s, vec3 w) { return basis_to_local(s.coat, w); }
vec3 principled_coat_from_local(Surface s, vec3 w) { return basis_to_world(s.coat, w); }
#else
float principled_coat_cosine(Surface s, vec3 w) { return w.z; }
vec3 principled_coat_to_local(Surface s, vec3 w) { return w; }
vec3 principled_coat_from_local(Surface s, vec3 w) { return w; }
#endif

float principled_coat_albedo(Surface s, float c) {
#if HAS_CLEARCOAT
    return principled_clearcoat_albedo(s, c);
#else
    return 0.0;
#endif
}

float principled_sheen_albedo(Surface s, float c) {
#if HAS_SHEEN
    return max_component(s.sheen) * energy_sheen(c, s.sheen_roughness);
#else
    return 0.0;
#endif
}

vec4 principled_albedo(Surface s, vec3 w) {
    return energy_albedo(bsdf_turn(s, w), s.is_delta ? 0.0 : s.roughness, s.aspect, s.eta_outside);
}

// Sets what depends on the side that the surface is seen from; `behind` is the inner side of its geometry.
void principled_side(bool behind, inout Surface s) {
#if HAS_TRANSMISSION
    s.inside = behind && s.transmission > 0.0 && s.metallic < 1.0;
    s.eta = s.inside ? 1.0 / s.eta_outside : s.eta_outside;
#endif
}

// Completes the surface with what depends on wo.
void principled_face(vec3 wo, bool behind, inout Surface s) {
    principled_side(behind, s);
    s.albedo = principled_albedo(s, wo);
    s.albedo_mean = energy_mean(s.is_delta ? 0.0 : s.roughness, s.aspect, s.eta_outside);
    // The layers lie on the outer side only.
    s.coat_albedo = s.inside ? 0.0 : principled_coat_albedo(s, principled_coat_cosine(s, wo));
    s.sheen_albedo = s.inside ? 0.0 : principled_sheen_albedo(s, wo.z);
}

// The share that comes back of the light that single scattering loses between microfacets of the mixed base.
vec3 principled_multiscatter(Surface s) {
    vec3 metal = multiscatter_fresnel(s.base_color + (1.0 - s.base_color) / 21.0, s.albedo_mean.x);
    vec3 tinted = multiscatter_fresnel(principled_specular_tinted(s, fresnel_mean(s.eta_outside)), s.albedo_mean.x);
    return mix(tinted * (1.0 - s.transmission), metal, s.metallic);
}

PrincipledWeights principled_weights(Surface s, vec3 wo) {
    float clear = multiscatter_fresnel(fresnel_mean(s.eta_outside), s.albedo_mean.x);
    PrincipledWeights w;
    w.diffuse = principled_diffuse_weight(s, multiscatter_albedo(s.albedo, clear))
            + (1.0 - s.albedo.x) * luminance(principled_multiscatter(s));
    w.diffuse_below = 0.0;
    float specular = luminance(principled_specular_fresnel(s, wo.z));
#if HAS_TRANSMISSION
    specular += luminance(principled_specular_transmittance(s, wo.z));
    if (multiscatter_glass(s)) {
        float glass = (1.0 - s.metallic) * s.transmission;
        float t = multiscatter_transmit_chance(s), lost = glass * multiscatter_near(s, s.albedo);
        w.diffuse += lost * (1.0 - t);
        w.diffuse_below = lost * t * luminance(s.base_color);
        specular *= 1.0 - lost;
        // Where nearly all directions are totally reflected, a rough lobe as a whole is nearly diffuse and light stays
        // inside for many bounces: microfacets that lead nowhere would make the weights grow with each bounce.
        float share = s.inside ? s.eta * s.eta : 1.0; // of the directions inside that lead out
        float spread = 0.6 * glass * sqr(sqr(s.roughness * (1.0 - share))) * specular;
        specular -= spread;
        w.diffuse += spread * (1.0 - share);
        w.diffuse_below += spread * share * luminance(s.base_color);
    }
#endif
    // The floor of 0.05 keeps the lobe sampled where it is faint from here, as it rises to 1 towards grazing angles.
    w.specular = max(0.05, specular);
    float under = principled_layers(s, 0.0, 0.0);
    w.diffuse *= under;
    w.diffuse_below *= under;
    w.specular *= under;
    w.sheen = 0.0;
    w.coat = 0.0;
#if HAS_SHEEN
    w.sheen = s.sheen_albedo;
#endif
#if HAS_CLEARCOAT
    w.coat = s.coat_albedo;
#endif
    float inv = 1.0 / (w.diffuse + w.diffuse_below + w.specular + w.sheen + w.coat);
    return PrincipledWeights(w.diffuse * inv, w.diffuse_below * inv, w.specular * inv, w.sheen * inv, w.coat * inv);
}

#if HAS_TRANSMISSION
Scatter principled_eval_below(Surface s, vec3 wo, vec3 wi, PrincipledWeights w) {
    if (s.transmission <= 0.0 || s.metallic >= 1.0) return Scatter(vec3(0.0), 0.0);
    vec3 wo_t = bsdf_turn(s, wo), wi_t = bsdf_turn(s, wi);
    vec3 f = LOBE(LOBE_MULTISCATTER, multiscatter_transmit(s, principled_albedo(s, wi)));
    float pdf = w.diffuse_below * INV_PI * -wi.z;
    vec3 wm = principled_specular_half_vector(s, wo_t, wi_t);
    if (!s.is_delta && !s.index_matched) {
        pdf += w.specular * principled_specular_transmit_folded(s, wo_t, wi_t);
        if (wm.z > 0.0) {
            f += LOBE(LOBE_TRANSMISSION, principled_specular_transmit(s, wo_t, wi_t, wm));
            pdf += w.specular * principled_specular_transmit_pdf(s, wo_t, wi_t, wm);
        }
    }
    float coat_i = s.inside ? principled_coat_albedo(s, principled_coat_cosine(s, wi)) : 0.0;
    float sheen_i = s.inside ? principled_sheen_albedo(s, wi.z) : 0.0;
    return Scatter(f * principled_layers(s, coat_i, sheen_i), pdf);
}
#endif

// Without the perfectly specular lobes.
Scatter principled_eval(Surface s, vec3 wo, vec3 wi) {
    PrincipledWeights w = principled_weights(s, wo);
    vec3 wm = normalize(wo + wi);
    float cos_d = dot(wo, wm);
    vec3 wo_t = wo, wi_t = wi, wm_t = wm;
#if HAS_ANISOTROPIC
    wo_t = bsdf_turn(s, wo);
    wi_t = bsdf_turn(s, wi);
    wm_t = bsdf_turn(s, wm);
#endif
    float clear = multiscatter_fresnel(fresnel_mean(s.eta_outside), s.albedo_mean.x);
    vec4 albedo_i = principled_albedo(s, wi);
    vec3 f = LOBE(LOBE_DIFFUSE, principled_diffuse_eval(s, wo.z, wi.z, multiscatter_albedo(s.albedo, clear),
                                                        multiscatter_albedo(albedo_i, clear),
                                                        multiscatter_albedo(s.albedo_mean, clear)));
    f += LOBE(LOBE_MULTISCATTER, multiscatter_reflect(s, albedo_i, principled_multiscatter(s)));
    float pdf = w.diffuse * INV_PI * wi.z;
    if (!s.is_delta) {
        f += LOBE(LOBE_SPECULAR, principled_specular_reflect(s, wo_t, wi_t, wm_t, cos_d));
        pdf += w.specular * principled_specular_reflect_pdf(s, wo_t, wm_t, cos_d);
#if HAS_TRANSMISSION
        pdf += w.specular * principled_specular_reflect_folded(s, wo_t, wi_t);
#endif
    }
    if (!s.inside) {
        float coat_i = principled_coat_albedo(s, principled_coat_cosine(s, wi));
        float sheen_i = principled_sheen_albedo(s, wi.z);
        f *= principled_layers(s, coat_i, sheen_i);
#if HAS_SHEEN
        f += LOBE(LOBE_SHEEN, sheen_charlie_eval(s, wo, wi) * (1.0 - max(s.coat_albedo, coat_i)));
        pdf += w.sheen * sheen_charlie_pdf();
#endif
#if HAS_CLEARCOAT && !HAS_COAT_NORMALS
        f += LOBE(LOBE_CLEARCOAT, principled_clearcoat_eval(s, wo, wi, wm, cos_d));
        pdf += w.coat * principled_clearcoat_pdf(s, wo, wm);
#endif
    }
#if HAS_TRANSMISSION
    if (wi.z < 0.0) return principled_eval_below(s, wo, wi, w);
#endif
    return Scatter(f, pdf);
}

#if HAS_COAT_NORMALS
// The coat alone, with the cosine: it may reflect light to where the base's normal sees none.
Scatter principled_coat_eval(Surface s, vec3 wo, vec3 wi) {
    vec3 o = principled_coat_to_local(s, wo), i = principled_coat_to_local(s, wi);
    if (s.inside || o.z <= 0.0 || i.z <= 0.0) return Scatter(vec3(0.0), 0.0);
    vec3 wm = normalize(o + i);
    float f = principled_clearcoat_eval(s, o, i, wm, dot(o, wm)) * i.z;
    return Scatter(vec3(f), principled_weights(s, wo).coat * principled_clearcoat_pdf(s, o, wm));
}
#endif

// Samples the microfacet lobe, which is picked with the chance `weight`.
LobeSample principled_sample_specular(Surface s, vec3 wo, float v, vec2 u, float weight) {
    vec3 wi = bsdf_turn_back(s, principled_specular_sample(s, bsdf_turn(s, wo), v, u));
    LobeSample r = LobeSample(wi, s.is_delta, Scatter(vec3(0.0), 0.0), false);
    float chance = principled_specular_reflect_chance(s, wo.z);
    vec3 f = principled_specular_fresnel(s, wo.z);
    float coat_i = s.coat_albedo, sheen_i = s.sheen_albedo; // in a mirror wi has the cosine of wo
#if HAS_TRANSMISSION
    if (wi.z < 0.0) {
        if (s.index_matched) r.is_delta = true;
        f = principled_specular_transmittance(s, wo.z);
        chance = 1.0 - chance;
        if (s.inside) {
            coat_i = principled_coat_albedo(s, principled_coat_cosine(s, wi));
            sheen_i = principled_sheen_albedo(s, wi.z);
        }
    }
#endif
    if (r.is_delta) r.scatter = Scatter(f * principled_layers(s, coat_i, sheen_i), weight * chance);
    return r;
}

#if HAS_CLEARCOAT
// Samples the coat, which is picked with the chance `weight`.
LobeSample principled_sample_coat(Surface s, vec3 wo, vec2 u, float weight) {
    vec3 wi = principled_coat_from_local(s, principled_clearcoat_sample(s, principled_coat_to_local(s, wo), u));
    float f = s.clearcoat * fresnel_dielectric(principled_coat_cosine(s, wo), CLEARCOAT_ETA);
    LobeSample r = LobeSample(wi, s.coat_is_delta, Scatter(vec3(0.0), 0.0), true);
    if (r.is_delta) r.scatter = Scatter(vec3(f), weight);
    return r;
}
#endif

LobeSample principled_sample(Surface s, vec3 wo, float u_lobe, vec2 u) {
    PrincipledWeights w = principled_weights(s, wo);
    LobeSample r = bsdf_rough_sample(sampling_cosine(u));
    float v = u_lobe - w.diffuse;
#if HAS_TRANSMISSION
    if (v >= 0.0) r.wi.z = -r.wi.z;
    v -= w.diffuse_below;
#endif
    LobeSample facet = principled_sample_specular(s, wo, clamp(v / w.specular, 0.0, 0.9999999), u, w.specular);
    if (v >= 0.0) r = facet;
    v -= w.specular;
#if HAS_SHEEN
    if (v >= 0.0 && w.sheen > 0.0) {
        r.wi = sheen_charlie_sample(u);
        r.is_delta = false;
    }
    v -= w.sheen;
#endif
#if HAS_CLEARCOAT
    if (v >= 0.0 && w.coat > 0.0) r = principled_sample_coat(s, wo, u, w.coat);
#endif
    return r;
}

// The chance that principled_sample picks a perfectly specular lobe.
float principled_delta_chance(Surface s, vec3 wo) {
    PrincipledWeights w = principled_weights(s, wo);
    float p = 0.0;
    float chance = principled_specular_reflect_chance(s, wo.z);
#if HAS_TRANSMISSION
    if (s.index_matched) p = w.specular * (1.0 - chance);
#endif
    if (s.is_delta) p = w.specular;
#if HAS_CLEARCOAT
    if (s.coat_is_delta) p += w.coat;
#endif
    return p;
}

// What principled_sample gives for a surface that only mirrors or refracts, without the work for other lobes; u_lobe
// picks one of the two. Sets the members that path_extend reads.
LobeSample principled_sample_delta(vec3 wo, bool behind, float u_lobe, inout Surface s) {
    principled_side(behind, s);
    float chance = principled_specular_reflect_chance(s, wo.z);
    vec3 wi = principled_specular_sample(s, wo, u_lobe, vec2(0.0));
    Scatter scatter = Scatter(principled_specular_fresnel(s, wo.z), chance);
#if HAS_TRANSMISSION
    if (u_lobe >= chance) scatter = Scatter(principled_specular_transmittance(s, wo.z), 1.0 - chance);
#endif
    return LobeSample(wi, true, scatter, false);
}

// The perfectly specular lobes, each as principled_sample gives it; those that the surface lacks are left alone.
void principled_deltas(Surface s, vec3 wo, inout LobeSample deltas[BSDF_DELTAS]) {
    PrincipledWeights w = principled_weights(s, wo);
    LobeSample mirrored = principled_sample_specular(s, wo, 0.0, vec2(0.0), w.specular);
    if (mirrored.is_delta && mirrored.wi.z > 0.0) deltas[0] = mirrored;
    LobeSample refracted = principled_sample_specular(s, wo, 0.9999999, vec2(0.0), w.specular);
    if (refracted.is_delta && refracted.wi.z < 0.0) deltas[1] = refracted;
#if HAS_CLEARCOAT
    LobeSample coat = principled_sample_coat(s, wo, vec2(0.0), w.coat);
    if (coat.is_delta) deltas[2] = coat;
#endif
}

Terms principled_terms(Surface s, vec3 wo, vec3 wi, vec3 wm) {
    return Terms(principled_specular_fresnel(s, wm.z), ggx_d(bsdf_turn(s, wm), s.alpha),
                 ggx_visibility(bsdf_turn(s, wo), bsdf_turn(s, wi), s.alpha), !s.is_delta);
}
#endif
