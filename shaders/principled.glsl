// The production model: coat over sheen over a base that is mixed of metal, matte under a dielectric, and glass. Each
// layer leaves 1 - max(E(o), E(i)) of its albedo E to what is under it, which is reciprocal and gains nothing
// [Kulla & Conty 2017, section 4]. Departs from the 2012 course notes where their terms gain or lose light.
#if HAS_PRINCIPLED

// Chances of picking each lobe, summing to one.
struct PrincipledWeights {
    float matte;   // with what scatters between facets, above
    float through; // that, below
    float facets;
    float sheen;
    float coat;
};

// What the layers above the base leave to it, between one direction outside and, where both are outside, another.
float principled_layers(Surface s, float coat_i, float sheen_i) {
    return (1.0 - max(s.coat_kept, coat_i)) * (1.0 - max(s.sheen_kept, sheen_i));
}

#if HAS_COAT_NORMALS
// The coat's own frame, where its normal is not that of what is under it.
float principled_coat_cosine(Surface s, vec3 w) { return dot(s.coat.z, w); }
#else
#define principled_coat_cosine(s, w) w.z
#endif

float principled_coat_kept(Surface s, float c) {
#if HAS_CLEARCOAT
    return coat_kept(s, c);
#else
    return 0.0;
#endif
}

float principled_sheen_kept(Surface s, float c) {
#if HAS_SHEEN
    return max_component(s.sheen) * energy_sheen(c, s.sheen_roughness);
#else
    return 0.0;
#endif
}

vec4 principled_kept(Surface s, vec3 w) {
    return energy_albedo(bsdf_turn(s, w), s.mirror ? 0.0 : s.roughness, s.aspect, s.eta_outside);
}

// `behind`: the surface is seen from the inner side of its geometry.
void principled_side(bool behind, inout Surface s) {
#if HAS_TRANSMISSION
    s.inside = behind && s.transmission > 0.0 && s.metallic < 1.0;
    s.eta = s.inside ? 1.0 / s.eta_outside : s.eta_outside;
#endif
}

// The surface as seen from wo.
void principled_face(vec3 wo, bool behind, inout Surface s) {
    if (s.model != MODEL_PRINCIPLED) return;
    principled_side(behind, s);
    s.kept = principled_kept(s, wo);
    s.kept_mean = energy_mean(s.mirror ? 0.0 : s.roughness, s.aspect, s.eta_outside);
    // The layers lie on the outer side.
    s.coat_kept = s.inside ? 0.0 : principled_coat_kept(s, principled_coat_cosine(s, wo));
    s.sheen_kept = s.inside ? 0.0 : principled_sheen_kept(s, wo.z);
}

// What comes back of light lost between facets: metal and dielectric as mixed.
vec3 principled_share(Surface s) {
    vec3 metal = scattered_share(s.base_color + (1.0 - s.base_color) / 21.0, s.kept_mean.x);
    vec3 tinted = scattered_share(facets_tinted(s, fresnel_mean(s.eta_outside)), s.kept_mean.x);
    return mix(tinted * (1.0 - s.transmission), metal, s.metallic);
}

PrincipledWeights principled_weights(Surface s, vec3 wo) {
    float clear = scattered_share(fresnel_mean(s.eta_outside), s.kept_mean.x);
    PrincipledWeights w;
    w.matte = matte_weight(s, scattered_kept(s.kept, clear))
            + (1.0 - s.kept.x) * luminance(principled_share(s));
    w.through = 0.0;
    float facets = luminance(facets_fresnel(s, wo.z));
#if HAS_TRANSMISSION
    facets += luminance(facets_through(s, wo.z));
    if (scattered_glass(s)) {
        float glass = (1.0 - s.metallic) * s.transmission;
        float t = scattered_through(s), lost = glass * scattered_near(s, s.kept);
        w.matte += lost * (1.0 - t);
        w.through = lost * t * luminance(s.base_color);
        facets *= 1.0 - lost;
        // Where nearly all directions are wholly reflected, all of a rough lobe is nearly diffuse, and light stays for
        // many bounces: facets that lead nowhere would make weights grow with each.
        float share = s.inside ? s.eta * s.eta : 1.0; // of the directions inside, those that lead out
        float spread = 0.6 * glass * sqr(sqr(s.roughness * (1.0 - share))) * facets;
        facets -= spread;
        w.matte += spread * (1.0 - share);
        w.through += spread * share * luminance(s.base_color);
    }
#endif
    // The floor keeps the lobe sampled where it is faint from here: it rises to 1 towards grazing.
    w.facets = max(0.05, facets);
    float under = principled_layers(s, 0.0, 0.0);
    w.matte *= under;
    w.through *= under;
    w.facets *= under;
    w.sheen = 0.0;
    w.coat = 0.0;
#if HAS_SHEEN
    w.sheen = s.sheen_kept;
#endif
#if HAS_CLEARCOAT
    w.coat = s.coat_kept;
#endif
    float inv = 1.0 / (w.matte + w.through + w.facets + w.sheen + w.coat);
    return PrincipledWeights(w.matte * inv, w.through * inv, w.facets * inv, w.sheen * inv, w.coat * inv);
}

#if HAS_TRANSMISSION
Scatter principled_eval_below(Surface s, vec3 wo, vec3 wi, PrincipledWeights w) {
    if (s.transmission <= 0.0 || s.metallic >= 1.0) return Scatter(vec3(0.0), 0.0);
    vec3 wo_t = bsdf_turn(s, wo), wi_t = bsdf_turn(s, wi);
    vec3 f = scattered_transmit(s, principled_kept(s, wi));
    float pdf = w.through * INV_PI * -wi.z;
    vec3 wm = facets_between(s, wo_t, wi_t);
    if (!s.mirror && !s.straight) {
        pdf += w.facets * facets_transmit_folded(s, wo_t, wi_t);
        if (wm.z > 0.0) {
            f += facets_transmit(s, wo_t, wi_t, wm);
            pdf += w.facets * facets_transmit_pdf(s, wo_t, wi_t, wm);
        }
    }
    float coat_i = s.inside ? principled_coat_kept(s, principled_coat_cosine(s, wi)) : 0.0;
    float sheen_i = s.inside ? principled_sheen_kept(s, wi.z) : 0.0;
    return Scatter(f * principled_layers(s, coat_i, sheen_i), pdf);
}
#endif

// f without the cosine of wi; perfectly specular parts apart.
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
    float clear = scattered_share(fresnel_mean(s.eta_outside), s.kept_mean.x);
    vec4 kept_i = principled_kept(s, wi);
    vec3 f = matte_eval(s, wo.z, wi.z, scattered_kept(s.kept, clear), scattered_kept(kept_i, clear),
                        scattered_kept(s.kept_mean, clear));
    f += scattered_reflect(s, kept_i, principled_share(s));
    float pdf = w.matte * INV_PI * wi.z;
    if (!s.mirror) {
        f += facets_reflect(s, wo_t, wi_t, wm_t, cos_d);
        pdf += w.facets * facets_reflect_pdf(s, wo_t, wm_t, cos_d);
#if HAS_TRANSMISSION
        pdf += w.facets * facets_reflect_folded(s, wo_t, wi_t);
#endif
    }
    if (!s.inside) {
        float coat_i = principled_coat_kept(s, principled_coat_cosine(s, wi)), sheen_i = principled_sheen_kept(s, wi.z);
        f *= principled_layers(s, coat_i, sheen_i);
#if HAS_SHEEN
        f += fabric_eval(s, wo, wi) * (1.0 - max(s.coat_kept, coat_i));
        pdf += w.sheen * fabric_pdf();
#endif
#if HAS_CLEARCOAT && !HAS_COAT_NORMALS
        f += coat_eval(s, wo, wi, wm, cos_d);
        pdf += w.coat * coat_pdf(s, wo, wm);
#endif
    }
#if HAS_TRANSMISSION
    if (wi.z < 0.0) return principled_eval_below(s, wo, wi, w);
#endif
    return Scatter(f, pdf);
}

#if HAS_COAT_NORMALS
// The coat alone, with the cosine: it may send light where the base's normal sees none.
Scatter principled_coat(Surface s, vec3 wo, vec3 wi) {
    vec3 o = frame_to_local(s.coat, wo), i = frame_to_local(s.coat, wi);
    if (s.model != MODEL_PRINCIPLED || s.inside || o.z <= 0.0 || i.z <= 0.0) return Scatter(vec3(0.0), 0.0);
    vec3 wm = normalize(o + i);
    return Scatter(vec3(coat_eval(s, o, i, wm, dot(o, wm)) * i.z), principled_weights(s, wo).coat * coat_pdf(s, o, wm));
}
#endif

// A direction, and whether a perfectly specular lobe gave it: then `there` is its reflectance and its chance.
vec3 principled_sample(Surface s, vec3 wo, float u_lobe, vec2 u, out bool specular, out Scatter there
#if HAS_COAT_NORMALS
    , out bool coated
#endif
) {
    PrincipledWeights w = principled_weights(s, wo);
    there = Scatter(vec3(0.0), 0.0);
    specular = false;
    vec3 wi = sampling_cosine(u);
    float v = u_lobe - w.matte;
#if HAS_TRANSMISSION
    if (v >= 0.0) wi.z = -wi.z;
    v -= w.through;
#endif
    vec3 facet = bsdf_turn_back(s, facets_sample(s, bsdf_turn(s, wo), clamp(v / w.facets, 0.0, 0.9999999), u));
    if (v >= 0.0) {
        wi = facet;
        bool below = facet.z < 0.0;
        float chance = facets_choice(s, wo.z);
        specular = s.mirror;
        vec3 f = facets_fresnel(s, wo.z);
#if HAS_TRANSMISSION
        if (below && s.straight) specular = true;
        if (below) {
            f = facets_through(s, wo.z);
            chance = 1.0 - chance;
        }
#endif
        float coat_i = s.coat_kept, sheen_i = s.sheen_kept; // a mirror's wi has wo's cosine
#if HAS_TRANSMISSION
        if (below && s.inside) {
            coat_i = principled_coat_kept(s, principled_coat_cosine(s, wi));
            sheen_i = principled_sheen_kept(s, wi.z);
        }
#endif
        if (specular) there = Scatter(f * principled_layers(s, coat_i, sheen_i), w.facets * chance);
    }
    v -= w.facets;
#if HAS_SHEEN
    if (v >= 0.0 && w.sheen > 0.0) {
        wi = fabric_sample(u);
        specular = false;
    }
    v -= w.sheen;
#endif
#if HAS_CLEARCOAT
#if HAS_COAT_NORMALS
    vec3 coat = frame_to_world(s.coat, coat_sample(s, frame_to_local(s.coat, wo), u));
    coated = v >= 0.0 && w.coat > 0.0;
#else
    vec3 coat = coat_sample(s, wo, u);
#endif
    if (v >= 0.0 && w.coat > 0.0) {
        wi = coat;
        specular = s.coat_mirror;
        if (specular) there = Scatter(vec3(s.clearcoat * fresnel_dielectric(principled_coat_cosine(s, wo), COAT_ETA)), w.coat);
    }
#endif
    return wi;
}

// The chance that principled_sample's direction comes from a perfectly specular lobe.
float principled_specular(Surface s, vec3 wo) {
    PrincipledWeights w = principled_weights(s, wo);
    float p = 0.0;
    float chance = facets_choice(s, wo.z);
#if HAS_TRANSMISSION
    if (s.straight) p = w.facets * (1.0 - chance);
#endif
    if (s.mirror) p = w.facets;
#if HAS_CLEARCOAT
    if (s.coat_mirror) p += w.coat;
#endif
    return p;
}
#endif
