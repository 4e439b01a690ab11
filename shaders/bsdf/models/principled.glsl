// The production model: a coat over a sheen over a base that mixes metal, a diffuse material under a dielectric, and
// glass. A layer of albedo E leaves 1 - max(E(o), E(i)) of the light to what is under it, which is reciprocal and gains
// nothing [Kulla & Conty 2017, section 4]. The model departs from the 2012 course notes where those gain or lose light.
#include "bsdf/energy.glsl"
#include "bsdf/lobes/base/film.glsl"
#include "bsdf/lobes/principled/diffuse.glsl"
#include "bsdf/lobes/principled/sheen_charlie.glsl"
#include "bsdf/lobes/principled/clearcoat.glsl"
#include "bsdf/lobes/base/pane.glsl"
#include "bsdf/lobes/base/multiscatter.glsl"
#include "bsdf/lobes/base/specular.glsl"
#include "bsdf/lobes/base/shares.glsl"
#include "bsdf/lobes/base/base.glsl"

#if HAS_PRINCIPLED
// Sets the members that do not depend on the direction; principled_face sets the others.
void principled_surface(Material m, vec2 tangent, inout Surface s) {
    float largest = max_component(m.base_color);
    vec3 tint = largest > 0.0 ? m.base_color / largest : vec3(1.0);
    s.specular_color = m.specular_color * mix(vec3(1.0), tint, m.specular_tint);
    float f0 = sqrt(0.08 * m.specular);
    s.eta_outside = m.ior >= 1.0 ? m.ior : (1.0 + f0) / (1.0 - f0);
    s.clear_color = m.base_color;
    s.index_matched = s.eta_outside < 1.0001;
    if (s.index_matched) s.eta_outside = 1.0;
    s.eta = s.eta_outside;
    s.excess = 0.0;
    s.transmission = 0.0;
    s.inside = false;
#if HAS_TRANSMISSION
    s.transmission = m.transmission;
#endif
    s.is_delta = m.roughness < LEAST_ROUGHNESS;
#if HAS_THIN_WALLS
    s.is_thin = m.thin_walled > 0.0;
    s.pane_narrowing = pane_narrowing(s.eta_outside);
    s.diffuse_transmission = s.is_thin ? m.diffuse_transmission : 0.0;
    s.diffuse_through = m.diffuse_transmission_color.x >= 0.0 ? m.diffuse_transmission_color : m.base_color;
#endif
#if ANY_FILM
    film_surface(m, s);
#endif
#if HAS_METAL_FILM
    if (s.film > 0.0) film_metal_index(s.base_color, vec3(1.0), 1.0, s);
#if HAS_CONDUCTOR
    if (m.conductor_eta.x > 0.0) {
        s.film_eta = m.conductor_eta;
        s.film_k = m.conductor_k;
    }
#endif
#endif
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
#if HAS_CONDUCTOR
    s.conductor_eta = m.conductor_eta;
    s.conductor_k = m.conductor_k;
    s.metal_mean = vec3(0.0); // until principled_face
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

// The tinted reflectance of the dielectric: the colour multiplies F0, 1 stays 1, and none is above the untinted one.
vec3 principled_tinted(Surface s, BASE_SHARE f) {
    float f0 = fresnel_normal(s.eta_outside);
    return max(vec3(0.0), f - (1.0 - s.specular_color) * (f0 / (1.0 - f0) * (1.0 - f)));
}

// The metal's reflectance at cosine c: that of its indices, or Schlick's.
vec3 principled_metal(Surface s, float c) {
#if HAS_CONDUCTOR
    if (s.conductor_eta.x > 0.0) return fresnel_conductor(s.conductor_eta, s.conductor_k, c);
#endif
    return mix(s.base_color, vec3(1.0), fresnel_schlick(c));
}

// Its cosine-weighted mean.
vec3 principled_metal_mean(Surface s) {
#if HAS_CONDUCTOR
    if (s.conductor_eta.x > 0.0) return s.metal_mean;
#endif
    return s.base_color + (1.0 - s.base_color) / 21.0;
}

#if HAS_CONDUCTOR
vec3 principled_conductor_mean(Surface s) {
    vec3 mean = vec3(0.0);
    for (int i = 0; i < 4; i++)
        mean += FRESNEL_WEIGHTS[i] * fresnel_conductor(s.conductor_eta, s.conductor_k, FRESNEL_COSINES[i]);
    return mean;
}
#endif

// The chances of picking each lobe; they sum to one.
struct PrincipledWeights {
    BaseWeights base;
    float sheen;
    float coat;
    float walk;
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

// Sets what the layers keep of light from wo: they lie on the outer side only.
void principled_face_layers(vec3 wo, inout Surface s) {
    s.coat_albedo = s.inside ? 0.0 : principled_coat_albedo(s, principled_coat_cosine(s, wo));
    s.sheen_albedo = s.inside ? 0.0 : principled_sheen_albedo(s, wo.z);
}

// The share of light that the layers leave to the perfectly smooth base, which sends it to wi.
float principled_specular_layers(Surface s, vec3 wi) {
    float coat_i = s.coat_albedo, sheen_i = s.sheen_albedo; // in a mirror wi has the cosine of wo
#if HAS_TRANSMISSION
    if (wi.z < 0.0 && s.inside) {
        coat_i = principled_coat_albedo(s, principled_coat_cosine(s, wi));
        sheen_i = principled_sheen_albedo(s, wi.z);
    }
#endif
    return principled_layers(s, coat_i, sheen_i);
}

// Completes the surface with what depends on wo.
void principled_face(vec3 wo, bool behind, inout Surface s) {
    base_side(behind, s);
#if HAS_CONDUCTOR
    s.metal_mean = principled_conductor_mean(s);
#endif
    base_face(wo, s);
    principled_face_layers(wo, s);
}

#if HAS_WALKS
// What enters to walk under the surface, and the share of it that the base leaves on its way out. The layers, which
// reflect the same from both sides, take theirs once.
vec3 principled_entering(Surface s) {
    float share = (1.0 - s.metallic) * (1.0 - s.transmission) * s.walks * principled_layers(s, 0.0, 0.0);
    return share * vec3(1.0 - shares_kept(s));
}

vec3 principled_left(Surface s, vec3 wi) {
    return vec3((1.0 - shares_kept(s, wi, base_albedo(s, wi))) / max(1.0 - shares_kept_mean(s), 1e-6));
}
#endif

PrincipledWeights principled_weights(Surface s, vec3 wo) {
    float diffuse = principled_diffuse_weight(s, shares_kept(s));
#if HAS_THIN_WALLS
    float through = s.diffuse_transmission * principled_through_weight(s, shares_kept(s));
    BaseWeights base = base_weights(s, wo, (1.0 - s.diffuse_transmission) * diffuse);
    base.diffuse_below += through;
#else
    BaseWeights base = base_weights(s, wo, diffuse);
#endif
    float under = principled_layers(s, 0.0, 0.0);
    PrincipledWeights w = PrincipledWeights(base, 0.0, 0.0, 0.0);
#if HAS_WALKS
    w.walk = luminance(principled_entering(s));
#endif
    w.base.diffuse *= under;
    w.base.diffuse_below *= under;
    w.base.specular *= under;
#if HAS_SHEEN
    w.sheen = s.sheen_albedo;
#endif
#if HAS_CLEARCOAT
    w.coat = s.coat_albedo;
#endif
    float inv = 1.0 / (w.base.diffuse + w.base.diffuse_below + w.base.specular + w.sheen + w.coat + w.walk);
    w.base = BaseWeights(w.base.diffuse * inv, w.base.diffuse_below * inv, w.base.specular * inv);
    return PrincipledWeights(w.base, w.sheen * inv, w.coat * inv, w.walk * inv);
}

// Without the perfectly specular lobes.
Scatter principled_eval(Surface s, vec3 wo, vec3 wi) {
    PrincipledWeights w = principled_weights(s, wo);
    vec4 albedo_i = base_albedo(s, wi);
    Scatter facets = base_scatter(s, bsdf_turn(s, wo), bsdf_turn(s, wi));
    BASE_SHARE lost_i = BASE_SHARE(0.0);
#if HAS_TRANSMISSION
    lost_i = base_lost(s, wi, albedo_i);
    if (wi.z < 0.0) {
        Scatter below = base_eval_below(s, wo, wi, albedo_i, lost_i, facets, w.base);
        bool leaves = s.inside; // into the air, through the layers there
#if HAS_THIN_WALLS
        leaves = leaves || s.is_thin;
        below.f += LOBE(LOBE_DIFFUSE, principled_through_eval(s, shares_kept(s), shares_kept(s, wi, albedo_i),
                                                              shares_kept_mean(s)));
#endif
        float coat_i = leaves ? principled_coat_albedo(s, principled_coat_cosine(s, wi)) : 0.0;
        float sheen_i = leaves ? principled_sheen_albedo(s, wi.z) : 0.0;
        below.f *= principled_layers(s, coat_i, sheen_i);
        return below;
    }
#endif
    vec3 wm = normalize(wo + wi);
    float cos_d = dot(wo, wm);
    vec3 diffuse = principled_diffuse_eval(s, wo.z, wi.z, shares_kept(s), shares_kept(s, wi, albedo_i), shares_kept_mean(s));
#if HAS_THIN_WALLS
    diffuse *= 1.0 - s.diffuse_transmission;
#endif
    Scatter r = base_eval(s, wi, albedo_i, lost_i, diffuse, facets, w.base);
    if (!s.inside) {
        float coat_i = principled_coat_albedo(s, principled_coat_cosine(s, wi));
        float sheen_i = principled_sheen_albedo(s, wi.z);
        r.f *= principled_layers(s, coat_i, sheen_i);
#if HAS_SHEEN
        r.f += LOBE(LOBE_SHEEN, sheen_charlie_eval(s, wo, wi) * (1.0 - max(s.coat_albedo, coat_i)));
        r.pdf += w.sheen * sheen_charlie_pdf();
#endif
#if HAS_CLEARCOAT && !HAS_COAT_NORMALS
        r.f += LOBE(LOBE_CLEARCOAT, principled_clearcoat_eval(s, wo, wi, wm, cos_d));
        r.pdf += w.coat * principled_clearcoat_pdf(s, wo, wm);
#endif
    }
    return r;
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
    LobeSample r = base_sample_facet(s, wo, v, u, weight);
    if (r.is_delta) r.scatter.f *= principled_specular_layers(s, r.wi);
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
    float v = u_lobe - w.base.diffuse;
#if HAS_TRANSMISSION
    if (v >= 0.0) r.wi.z = -r.wi.z;
    v -= w.base.diffuse_below;
#endif
    LobeSample facet = principled_sample_specular(s, wo, clamp(v / w.base.specular, 0.0, 0.9999999), u, w.base.specular);
    if (v >= 0.0) r = facet;
    v -= w.base.specular;
#if HAS_SHEEN
    if (v >= 0.0 && w.sheen > 0.0) {
        r.wi = sheen_charlie_sample(u);
        r.is_delta = false;
    }
    v -= w.sheen;
#endif
#if HAS_CLEARCOAT
    if (v >= 0.0 && w.coat > 0.0) r = principled_sample_coat(s, wo, u, w.coat);
    v -= w.coat;
#endif
#if HAS_WALKS
    if (v >= 0.0 && w.walk > 0.0) r = bsdf_entering(wo, principled_entering(s), w.walk);
#endif
    return r;
}

// The chance that principled_sample picks a perfectly specular lobe.
float principled_delta_chance(Surface s, vec3 wo) {
    PrincipledWeights w = principled_weights(s, wo);
    float p = 0.0;
    float chance = base_level(s, wo).chance;
#if HAS_TRANSMISSION
    if (s.index_matched) p = w.base.specular * (1.0 - chance);
#endif
    if (s.is_delta) p = w.base.specular;
#if HAS_CLEARCOAT
    if (s.coat_is_delta) p += w.coat;
#endif
    return p + w.walk;
}

// What principled_sample gives for a surface that only mirrors or refracts, without the work for other lobes.
LobeSample principled_sample_delta(vec3 wo, bool behind, float u_lobe, float least, inout Surface s) {
    return base_sample_delta(wo, behind, u_lobe, least, s);
}

// The share of light from wo that goes straight through, where some does; completes the surface as far as that needs.
vec3 principled_straight(vec3 wo, bool behind, inout Surface s) {
    vec3 through = base_straight(wo, behind, s);
    principled_face_layers(wo, s);
    return through * principled_specular_layers(s, -wo);
}

// The perfectly specular lobes, each as principled_sample gives it; those that the surface lacks are left alone.
void principled_deltas(Surface s, vec3 wo, inout LobeSample deltas[BSDF_DELTAS]) {
    PrincipledWeights w = principled_weights(s, wo);
    LobeSample mirrored = principled_sample_specular(s, wo, 0.0, vec2(0.0), w.base.specular);
    if (mirrored.is_delta && mirrored.wi.z > 0.0) deltas[0] = mirrored;
    LobeSample refracted = principled_sample_specular(s, wo, 0.9999999, vec2(0.0), w.base.specular);
    if (refracted.is_delta && refracted.wi.z < 0.0) deltas[1] = refracted;
#if HAS_CLEARCOAT
    LobeSample coat = principled_sample_coat(s, wo, vec2(0.0), w.coat);
    if (coat.is_delta) deltas[2] = coat;
#endif
}

// What the coat leaves of light that is sent out from under it towards wo: 1 less its weight times its Fresnel
// reflectance there, whatever its roughness [Khronos, KHR_materials_clearcoat, "Emission"], by the coat's own index.
vec3 principled_emitted(vec3 wo, bool behind, inout Surface s) {
    base_side(behind, s);
    float left = 1.0;
#if HAS_CLEARCOAT
    if (!s.inside) left -= s.clearcoat * fresnel_dielectric(principled_coat_cosine(s, wo), CLEARCOAT_ETA);
#endif
    return vec3(left);
}

Terms principled_terms(Surface s, vec3 wo, vec3 wi, vec3 wm) {
    return Terms(base_fresnel(s, wm.z), ggx_d(bsdf_turn(s, wm), s.alpha),
                 ggx_visibility(bsdf_turn(s, wo), bsdf_turn(s, wi), s.alpha), !s.is_delta);
}
#endif
