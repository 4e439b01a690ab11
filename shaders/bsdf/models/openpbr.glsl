// OpenPBR Surface 1.1.1: fuzz over a coat over a base that mixes metal, a diffuse material under a dielectric, and glass.
// The base is reciprocal. A layer of albedo E for wo leaves 1 - E of the light to what is under it, whatever wi is:
// nothing is lost so, where a reciprocal rule would lose up to a tenth under a white coat.
#include "bsdf/energy.glsl"
#include "bsdf/lobes/base/film.glsl"
#include "bsdf/lobes/base/pane.glsl"
#include "bsdf/lobes/base/multiscatter.glsl"
#include "bsdf/lobes/base/specular.glsl"
#include "bsdf/lobes/base/shares.glsl"
#include "bsdf/lobes/base/base.glsl"
#include "bsdf/lobes/openpbr/metal.glsl"
#include "bsdf/lobes/openpbr/diffuse.glsl"
#include "bsdf/lobes/openpbr/coat.glsl"
#include "bsdf/lobes/openpbr/fuzz.glsl"
#include "bsdf/lobes/openpbr/film.glsl"

#if HAS_OPENPBR
// An index as the tables have it, at least 1 and at most their last; `excess` is the share of what a boundary of that
// index lets pass that a greater one reflects besides.
float openpbr_index(float eta, out float excess) {
    float end = fresnel_normal(ENERGY_LARGEST_ETA), f = fresnel_normal(eta);
    excess = clamp((f - end) / (1.0 - end), 0.0, 1.0);
    return clamp(max(eta, 1.0 / eta), 1.0, ENERGY_LARGEST_ETA);
}

// The alpha of both axes, and the aspect that the tables know: alpha_x is r^2 sqrt(2 / (1 + aspect^4)), alpha_y
// aspect^2 times that. Facets stretched further than the tables go are taken as their last.
vec2 openpbr_alpha(float roughness, float anisotropy, out float aspect) {
    float a = sqr(max(roughness, LEAST_ROUGHNESS));
    aspect = 1.0;
#if HAS_ANISOTROPIC
    float ratio = max(1.0 - anisotropy, sqr(ENERGY_LEAST_ASPECT));
    aspect = sqrt(ratio);
    a *= sqrt(2.0 / (1.0 + sqr(ratio)));
    return vec2(a, a * ratio);
#else
    return vec2(a);
#endif
}

// The tangent, turned counter-clockwise.
vec2 openpbr_tangent(vec2 tangent, float degrees) {
    float turn = radians(degrees);
    vec2 cs = vec2(cos(turn), sin(turn));
    return vec2(cs.x * tangent.x - cs.y * tangent.y, cs.y * tangent.x + cs.x * tangent.y);
}

// Sets the members that do not depend on the direction; openpbr_face sets the others.
void openpbr_surface(Material m, vec2 tangent, inout Surface s) {
    s.base_color = m.base_weight * m.base_color;
    s.specular_color = m.specular_color;
    s.specular_weight = m.specular;
    s.clear_color = m.attenuation_color;
#if HAS_ATTENUATION
    if (m.attenuation_distance > 0.0) s.clear_color = vec3(1.0); // the inside has that colour
#endif
    s.matte_color = s.base_color;
#if HAS_SUBSURFACE
    s.matte_color = mix(s.base_color, m.subsurface_color, s.subsurface);
#endif
    s.transmission = 0.0;
    s.inside = s.bare = false;
#if HAS_TRANSMISSION
    s.transmission = m.transmission;
#endif
    float eta = m.ior, roughness = m.roughness;
    s.coat_is_delta = false;
    s.clearcoat = 0.0;
#if HAS_CLEARCOAT
    s.clearcoat = m.clearcoat;
    // Under the coat the dielectric meets its index, turned over where that would reflect all of slanting light, as it
    // cannot once the coat has refracted it. Glass keeps its own, for a body must refract the same under a lacquer.
    float under = m.ior / m.coat_ior;
    eta = mix(eta, under < 1.0 && eta >= 1.0 ? 1.0 / under : under, m.clearcoat * (1.0 - s.transmission));
    float r2 = sqr(roughness), c2 = sqr(m.clearcoat_roughness);
    roughness = mix(roughness, sqrt(sqrt(min(1.0, r2 * r2 + 2.0 * c2 * c2))), m.clearcoat);
#endif
    s.turned_out = eta < 1.0;
    // `specular_weight` is a factor on the reflectance head-on; the index follows from that.
    float head_on = fresnel_normal(eta), weighted = min(sqrt(m.specular * head_on), 0.9999);
    s.eta_outside = openpbr_index((1.0 + weighted) / (1.0 - weighted), s.excess);
    s.index_matched = s.eta_outside < 1.0001;
    if (s.index_matched) s.eta_outside = 1.0;
    s.eta = s.eta_outside;
#if ANY_FILM
    openpbr_film(m, s);
#endif
    s.is_delta = roughness < LEAST_ROUGHNESS;
#if HAS_THIN_WALLS
    s.is_thin = m.thin_walled > 0.0;
    s.pane_narrowing = pane_narrowing(s.eta_outside);
    s.diffuse_transmission = s.is_thin ? m.diffuse_transmission : 0.0;
    s.diffuse_through = m.subsurface_color;
    s.matte_color -= s.diffuse_transmission * s.diffuse_through;
#endif
    s.alpha = openpbr_alpha(roughness, m.anisotropic, s.aspect);
    s.roughness = sqrt(sqrt(s.alpha.x * s.alpha.y)); // of the round lobe that the tables stretch
#if HAS_ANISOTROPIC
    s.tangent = m.anisotropic > 0.0 ? openpbr_tangent(tangent, m.anisotropic_rotation) : vec2(1.0, 0.0);
#endif
#if HAS_DIFFUSE_ROUGHNESS
    s.diffuse_roughness = m.diffuse_roughness;
#endif
#if HAS_SHEEN
    s.fuzz_weight = m.sheen;
    s.sheen = m.sheen * m.sheen_color;
    s.sheen_roughness = m.sheen_roughness;
#endif
#if HAS_CLEARCOAT
    s.coat_is_delta = m.clearcoat_roughness < LEAST_ROUGHNESS;
    s.alpha_coat_2 = openpbr_alpha(m.clearcoat_roughness, m.coat_anisotropy, s.coat_aspect);
    s.coat_roughness = s.coat_is_delta ? 0.0 : sqrt(sqrt(s.alpha_coat_2.x * s.alpha_coat_2.y));
    s.coat_tangent = vec2(1.0, 0.0);
#if HAS_ANISOTROPIC
    if (m.coat_anisotropy > 0.0) s.coat_tangent = openpbr_tangent(tangent, m.coat_rotation);
#endif
    s.coat_eta = openpbr_index(m.coat_ior, s.coat_excess);
    s.coat_color = m.coat_color;
    s.coat_darkening = vec3(m.coat_darkening); // until openpbr_face
#endif
}

// The reflectance of the dielectric with the model's colour, which light from inside does not see.
vec3 openpbr_tinted(Surface s, BASE_SHARE f) { return s.bare ? vec3(f) : f * s.specular_color; }

#if HAS_CLEARCOAT
// The albedo of the base head-on and its roughness, as the coat's darkening wants them.
vec3 openpbr_base_albedo(Surface s, out float roughness) {
    BASE_SHARE f = base_dielectric(s, 1.0, s.eta_outside);
    vec3 dielectric = f * s.specular_color + (1.0 - f) * mix(s.matte_color, s.clear_color, s.transmission);
    roughness = mix(mix(1.0, s.roughness, base_grey(f)), s.roughness, s.metallic);
    return mix(dielectric, base_metal(s, 1.0), s.metallic);
}
#endif

// Whether wo is inside a body that transmits. A thin wall is the same from both sides.
bool openpbr_is_bare(Surface s, bool behind) {
#if HAS_THIN_WALLS
    if (s.is_thin) return false;
#endif
    return behind && s.transmission > 0.0 && s.metallic < 1.0;
}

// Sets what the layers keep of light from wo.
void openpbr_face_layers(vec3 wo, inout Surface s) {
    s.coat_albedo = 0.0;
    s.sheen_albedo = 0.0;
#if HAS_SHEEN
    if (!s.bare) {
        s.fuzz = fuzz_look(wo.z, s.sheen_roughness);
        s.sheen_albedo = s.fuzz_weight * s.fuzz.z;
    }
#endif
#if HAS_CLEARCOAT
    if (!s.bare && s.clearcoat > 0.0) {
        vec3 o = coat_to_local(s, wo);
        float roughness;
        vec3 base = openpbr_base_albedo(s, roughness);
        s.coat_albedo = coat_albedo(s, o);
        vec3 darkened = coat_darkened(s, max(o.z, 0.0), base, roughness);
        s.coat_darkening = mix(vec3(1.0), darkened, s.clearcoat * s.coat_darkening);
    } else {
        s.coat_darkening = vec3(1.0);
    }
#endif
}

// Completes the surface with what depends on wo.
void openpbr_face(vec3 wo, bool behind, inout Surface s) {
    s.bare = openpbr_is_bare(s, behind);
    base_side(behind != s.turned_out, s);
    base_face(wo, s);
    openpbr_face_layers(wo, s);
}

// What the layers leave of light that the base scatters from wi into wo.
vec3 openpbr_layers(Surface s, vec3 wo, vec3 wi) {
    vec3 left = vec3(1.0);
#if HAS_SHEEN
    if (!s.bare) left *= 1.0 - s.sheen_albedo;
#endif
#if HAS_CLEARCOAT
    if (s.clearcoat > 0.0) {
        // The coat is crossed by those of the two that are outside.
        bool below = wi.z < 0.0;
        vec3 crossed = s.bare ? vec3(1.0) : coat_crossed(s, abs(coat_to_local(s, wo).z));
        if (s.bare == below) crossed *= coat_crossed(s, abs(coat_to_local(s, wi).z));
        left *= mix(vec3(1.0), crossed, s.clearcoat);
        if (!s.bare) left *= s.coat_darkening * (1.0 - s.coat_albedo);
    }
#endif
    return left;
}

// The chances of picking each lobe; they sum to one.
struct OpenpbrWeights {
    BaseWeights base;
    float fuzz;
    float coat;
    float walk;
};

#if HAS_WALKS
// What enters to walk under the surface, and the share of it that the layers leave on its way out.
vec3 openpbr_entering(Surface s, vec3 wo) {
    vec3 left = vec3((1.0 - s.sheen_albedo) * (1.0 - s.coat_albedo));
#if HAS_CLEARCOAT
    left *= mix(vec3(1.0), coat_crossed(s, abs(coat_to_local(s, wo).z)), s.clearcoat) * s.coat_darkening;
#endif
    return openpbr_diffuse_share(s) * s.walks * (1.0 - shares_kept(s)) * left;
}

vec3 openpbr_left(Surface s, vec3 wi) {
    vec3 left = vec3((1.0 - shares_kept(s, wi, base_albedo(s, wi))) / max(1.0 - shares_kept_mean(s), 1e-6));
#if HAS_CLEARCOAT
    left *= mix(vec3(1.0), coat_crossed(s, abs(coat_to_local(s, wi).z)), s.clearcoat);
#endif
    return left;
}
#endif

OpenpbrWeights openpbr_weights(Surface s, vec3 wo) {
    BaseWeights base = base_weights(s, wo, openpbr_diffuse_weight(s, shares_kept(s)));
#if HAS_THIN_WALLS
    base.diffuse_below += openpbr_through_weight(s, shares_kept(s));
#endif
    OpenpbrWeights w = OpenpbrWeights(base, 0.0, 0.0, 0.0);
#if HAS_WALKS
    w.walk = luminance(openpbr_entering(s, wo));
#endif
#if HAS_SHEEN
    w.fuzz = s.bare ? 0.0 : s.fuzz.z * luminance(s.sheen);
#endif
#if HAS_CLEARCOAT
    w.coat = s.coat_albedo * (1.0 - s.sheen_albedo);
#endif
    float under = (1.0 - s.coat_albedo) * (1.0 - s.sheen_albedo);
    float inv = 1.0 / ((base.diffuse + base.diffuse_below + base.specular) * under + w.coat + w.fuzz + w.walk);
    w.base = BaseWeights(base.diffuse * under * inv, base.diffuse_below * under * inv, base.specular * under * inv);
    return OpenpbrWeights(w.base, w.fuzz * inv, w.coat * inv, w.walk * inv);
}

// Without the perfectly specular lobes.
Scatter openpbr_eval(Surface s, vec3 wo, vec3 wi) {
    OpenpbrWeights w = openpbr_weights(s, wo);
    vec4 albedo_i = base_albedo(s, wi);
    Scatter facets = base_scatter(s, bsdf_turn(s, wo), bsdf_turn(s, wi));
    BASE_SHARE lost_i = BASE_SHARE(0.0);
#if HAS_TRANSMISSION
    lost_i = base_lost(s, wi, albedo_i);
    if (wi.z < 0.0) {
        Scatter below = base_eval_below(s, wo, wi, albedo_i, lost_i, facets, w.base);
#if HAS_THIN_WALLS
        vec3 through = openpbr_through_eval(s, shares_kept(s), shares_kept(s, wi, albedo_i), shares_kept_mean(s));
        below.f += LOBE(LOBE_DIFFUSE, through);
#endif
        below.f *= openpbr_layers(s, wo, wi);
        return below;
    }
#endif
    vec3 wm = normalize(wo + wi);
    vec3 diffuse = openpbr_diffuse_eval(s, wo, wi, shares_kept(s), shares_kept(s, wi, albedo_i), shares_kept_mean(s));
    Scatter r = base_eval(s, wi, albedo_i, lost_i, diffuse, facets, w.base);
    r.f *= openpbr_layers(s, wo, wi);
#if HAS_CLEARCOAT && !HAS_COAT_NORMALS
    if (!s.bare) {
        vec3 o = coat_to_local(s, wo), m = coat_to_local(s, wm);
        r.f += LOBE(LOBE_CLEARCOAT, coat_eval(s, o, coat_to_local(s, wi), m, dot(wo, wm)) * (1.0 - s.sheen_albedo));
        r.pdf += w.coat * coat_pdf(s, o, m);
    }
#endif
#if HAS_SHEEN
    if (!s.bare) {
        float fuzz = fuzz_pdf(s, wo, wi);
        r.f += LOBE(LOBE_SHEEN, s.sheen * (s.fuzz.z * fuzz / wi.z));
        r.pdf += w.fuzz * fuzz;
    }
#endif
    return r;
}

#if HAS_COAT_NORMALS
// The coat alone, with the cosine: it may reflect light to where the base's normal sees none.
Scatter openpbr_coat_eval(Surface s, vec3 wo, vec3 wi) {
    vec3 o = coat_to_local(s, wo), i = coat_to_local(s, wi);
    if (s.bare || o.z <= 0.0 || i.z <= 0.0) return Scatter(vec3(0.0), 0.0);
    vec3 wm = normalize(o + i);
    float f = coat_eval(s, o, i, wm, dot(o, wm)) * i.z * (1.0 - s.sheen_albedo);
    return Scatter(vec3(f), openpbr_weights(s, wo).coat * coat_pdf(s, o, wm));
}
#endif

// Samples the microfacets of the base, which are picked with the chance `weight`.
LobeSample openpbr_sample_specular(Surface s, vec3 wo, float v, vec2 u, float weight) {
    LobeSample r = base_sample_facet(s, wo, v, u, weight);
    if (r.is_delta) r.scatter.f *= openpbr_layers(s, wo, r.wi);
    return r;
}

#if HAS_CLEARCOAT
// Samples the coat, which is picked with the chance `weight`.
LobeSample openpbr_sample_coat(Surface s, vec3 wo, vec2 u, float weight) {
    vec3 o = coat_to_local(s, wo);
    LobeSample r = LobeSample(coat_from_local(s, coat_sample(s, o, u)), s.coat_is_delta, Scatter(vec3(0.0), 0.0), true);
    float f = s.clearcoat * coat_fresnel(s, max(o.z, 0.0)) * (1.0 - s.sheen_albedo);
    if (r.is_delta) r.scatter = Scatter(vec3(f), weight);
    return r;
}
#endif

LobeSample openpbr_sample(Surface s, vec3 wo, float u_lobe, vec2 u) {
    OpenpbrWeights w = openpbr_weights(s, wo);
    LobeSample r = bsdf_rough_sample(sampling_cosine(u));
    float v = u_lobe - w.base.diffuse;
#if HAS_TRANSMISSION
    if (v >= 0.0) r.wi.z = -r.wi.z;
    v -= w.base.diffuse_below;
#endif
    float share = clamp(v / w.base.specular, 0.0, 0.9999999);
    LobeSample facet = openpbr_sample_specular(s, wo, share, u, w.base.specular);
    if (v >= 0.0) r = facet;
    v -= w.base.specular;
#if HAS_SHEEN
    if (v >= 0.0 && w.fuzz > 0.0) r = bsdf_rough_sample(fuzz_sample(s, wo, u));
    v -= w.fuzz;
#endif
#if HAS_CLEARCOAT
    if (v >= 0.0 && w.coat > 0.0) r = openpbr_sample_coat(s, wo, u, w.coat);
    v -= w.coat;
#endif
#if HAS_WALKS
    if (v >= 0.0 && w.walk > 0.0) r = bsdf_entering(wo, openpbr_entering(s, wo), w.walk);
#endif
    return r;
}

// The chance that openpbr_sample picks a perfectly specular lobe.
float openpbr_delta_chance(Surface s, vec3 wo) {
    OpenpbrWeights w = openpbr_weights(s, wo);
    float p = 0.0;
#if HAS_TRANSMISSION
    if (s.index_matched) p = w.base.specular * (1.0 - base_level(s, wo).chance);
#endif
    if (s.is_delta) p = w.base.specular;
#if HAS_CLEARCOAT
    if (s.coat_is_delta) p += w.coat;
#endif
    return p + w.walk;
}

// What openpbr_sample gives for a surface that only mirrors or refracts, without the work for other lobes.
LobeSample openpbr_sample_delta(vec3 wo, bool behind, float u_lobe, float least, inout Surface s) {
    s.bare = openpbr_is_bare(s, behind);
    return base_sample_delta(wo, behind != s.turned_out, u_lobe, least, s);
}

// The share of light from wo that goes straight through, where some does; completes the surface as far as that needs.
vec3 openpbr_straight(vec3 wo, bool behind, inout Surface s) {
    s.bare = openpbr_is_bare(s, behind);
    vec3 through = base_straight(wo, behind != s.turned_out, s);
    openpbr_face_layers(wo, s);
    return through * openpbr_layers(s, wo, -wo);
}

// What fuzz and coat leave of light that is sent out from under them towards wo, without the reflections below the coat.
vec3 openpbr_emitted(vec3 wo, bool behind, inout Surface s) {
    s.bare = openpbr_is_bare(s, behind);
    openpbr_face_layers(wo, s);
    vec3 left = vec3(1.0 - s.sheen_albedo);
#if HAS_CLEARCOAT
    if (s.bare) return left;
    vec3 crossed = coat_crossed(s, coat_to_local(s, wo).z);
    left *= mix(vec3(1.0), crossed, s.clearcoat) * (1.0 - s.coat_albedo);
#endif
    return left;
}

// The perfectly specular lobes, each as openpbr_sample gives it; those that the surface lacks are left alone.
void openpbr_deltas(Surface s, vec3 wo, inout LobeSample deltas[BSDF_DELTAS]) {
    OpenpbrWeights w = openpbr_weights(s, wo);
    LobeSample mirrored = openpbr_sample_specular(s, wo, 0.0, vec2(0.0), w.base.specular);
    if (mirrored.is_delta && mirrored.wi.z > 0.0) deltas[0] = mirrored;
    LobeSample refracted = openpbr_sample_specular(s, wo, 0.9999999, vec2(0.0), w.base.specular);
    if (refracted.is_delta && refracted.wi.z < 0.0) deltas[1] = refracted;
#if HAS_CLEARCOAT
    LobeSample coat = openpbr_sample_coat(s, wo, vec2(0.0), w.coat);
    if (coat.is_delta) deltas[2] = coat;
#endif
}

Terms openpbr_terms(Surface s, vec3 wo, vec3 wi, vec3 wm) {
    return Terms(base_fresnel(s, wm.z), ggx_d(bsdf_turn(s, wm), s.alpha),
                 ggx_visibility(bsdf_turn(s, wo), bsdf_turn(s, wi), s.alpha), !s.is_delta);
}
#endif
