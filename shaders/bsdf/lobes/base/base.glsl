// A base that mixes metal, a diffuse material under a dielectric, and glass, without the layers on it. What its model
// decides are the reflectances: models_metal, models_metal_mean and models_tinted, and the Surface's clear_color. What
// lies on the boundary is known to base_dielectric and base_metal, and to shares.glsl.
#if ANY_NEEDS_TABLES
// What the facets of the tables' last index reflect and lose, as those of a greater one do: the share `excess` of the
// light that meets a facet is reflected whatever the angle.
vec4 base_exceeded(Surface s, vec4 albedo) {
    return vec4(albedo.x, mix(albedo.yzw, vec3(albedo.x, vec2(1.0 - albedo.x)), s.excess));
}

vec4 base_albedo(Surface s, vec3 w) {
    vec4 albedo = energy_albedo(bsdf_turn(s, w), s.is_delta ? 0.0 : s.roughness, s.aspect, s.eta_outside);
#if HAS_THIN_WALLS
    return pane_albedo(s, w, base_exceeded(s, albedo));
#else
    return base_exceeded(s, albedo);
#endif
}

vec4 base_albedo_mean(Surface s) {
    vec4 mean = energy_mean(s.is_delta ? 0.0 : s.roughness, s.aspect, s.eta_outside);
#if HAS_THIN_WALLS
    return pane_albedo_mean(s, base_exceeded(s, mean));
#else
    return base_exceeded(s, mean);
#endif
}

// Sets what depends on the side that the surface is seen from; `behind` is the inner side of its geometry.
void base_side(bool behind, inout Surface s) {
#if HAS_TRANSMISSION
    s.inside = behind && s.transmission > 0.0 && s.metallic < 1.0;
    s.eta = s.inside ? 1.0 / s.eta_outside : s.eta_outside;
#if HAS_THIN_WALLS
    if (s.is_thin) {
        s.inside = false;
        s.eta = 1.0;
    }
#endif
#endif
}

// Sets what depends on wo.
void base_face(vec3 wo, inout Surface s) {
    shares_face(wo, base_albedo(s, wo), base_albedo_mean(s), s);
#if HAS_FILM
    BaseFacet level = base_meets(s, wo.z);
    s.film_reflected = level.reflected;
    s.film_passed = level.passed;
    s.film_chance = level.chance;
#endif
}

// The share that comes back of the light that single scattering loses between microfacets of the mixed base.
vec3 base_multiscatter(Surface s) {
    vec3 metal = multiscatter_fresnel(base_metal_mean(s), s.albedo_mean.x);
    vec3 tinted = multiscatter_fresnel(models_tinted(s, base_dielectric_mean(s)), s.albedo_mean.x);
    return mix(tinted * (1.0 - s.transmission), metal, s.metallic);
}

// Measures of how much each lobe gives, by which one is picked.
struct BaseWeights {
    float diffuse;       // diffuse light and light between microfacets that leaves above the surface
    float diffuse_below; // light between microfacets that leaves below it
    float specular;
};

// `diffuse` is that of the diffuse lobe alone. The sum is not one.
BaseWeights base_weights(Surface s, vec3 wo, float diffuse) {
    BaseWeights w;
    w.diffuse = diffuse + (1.0 - s.albedo.x) * luminance(base_multiscatter(s));
    w.diffuse_below = 0.0;
    BaseFacet level = base_level(s, wo);
    float specular = luminance(level.reflected);
#if HAS_TRANSMISSION
    specular += luminance(base_through(s, level.passed));
    if (multiscatter_glass(s)) {
        float glass = (1.0 - s.metallic) * s.transmission;
        float t = base_grey(multiscatter_transmit_chance(s)), lost = glass * base_grey(shares_lost(s));
        w.diffuse += lost * (1.0 - t);
        w.diffuse_below = lost * t * luminance(s.clear_color);
        specular *= 1.0 - lost;
        // Where nearly all directions are totally reflected, a rough lobe as a whole is nearly diffuse and light stays
        // inside for many bounces: microfacets that lead nowhere would make the weights grow with each bounce.
        float share = s.inside ? s.eta * s.eta : 1.0; // of the directions inside that lead out
        float spread = 0.6 * glass * sqr(sqr(s.roughness * (1.0 - share))) * specular;
        specular -= spread;
        w.diffuse += spread * (1.0 - share);
        w.diffuse_below += spread * share * luminance(s.clear_color);
    }
#endif
    // The floor of 0.05 keeps the lobe sampled where it is faint from here, as it rises to 1 towards grazing angles.
    w.specular = max(0.05, specular);
    return w;
}

#if HAS_TRANSMISSION
// What wi loses between the facets, on the side where it is.
BASE_SHARE base_lost(Surface s, vec3 wi, vec4 albedo_i) { return shares_lost(s, wi, albedo_i, s.inside != (wi.z < 0.0)); }

// Of light that passes the base: f lacks the layers. `facets` is base_scatter's.
Scatter base_eval_below(Surface s, vec3 wo, vec3 wi, vec4 albedo_i, BASE_SHARE lost_i, Scatter facets, BaseWeights w) {
#if !HAS_THIN_WALLS
    if (s.transmission <= 0.0 || s.metallic >= 1.0) return Scatter(vec3(0.0), 0.0);
#endif
    vec3 f = LOBE(LOBE_MULTISCATTER, multiscatter_transmit(s, shares_lost(s), lost_i));
    float pdf = w.diffuse_below * INV_PI * -wi.z;
#if HAS_THIN_WALLS
    if (s.is_thin) {
        vec3 wo_t = bsdf_turn(s, wo), image_t = bsdf_turn(s, base_image(wi));
        Scatter through = pane_eval(s, wo_t, image_t, albedo_i, w.specular, base_level(s, wo).chance);
        return Scatter(f + LOBE(LOBE_TRANSMISSION, through.f), pdf + through.pdf);
    }
    if (s.transmission <= 0.0 || s.metallic >= 1.0) return Scatter(vec3(0.0), 0.0);
#endif
    if (!s.is_delta && !s.index_matched) {
        f += LOBE(LOBE_TRANSMISSION, facets.f);
        pdf += w.specular * facets.pdf;
    }
    return Scatter(f, pdf);
}
#endif

// Of light that the base scatters back, without the perfectly specular lobes; `diffuse` is the diffuse lobe's, `facets`
// base_scatter's.
Scatter base_eval(Surface s, vec3 wi, vec4 albedo_i, BASE_SHARE lost_i, vec3 diffuse, Scatter facets, BaseWeights w) {
    vec3 f = LOBE(LOBE_DIFFUSE, diffuse);
    vec3 again = multiscatter_reflect(s, albedo_i, base_multiscatter(s));
#if HAS_TRANSMISSION
    again += multiscatter_beside(s, shares_lost(s), lost_i);
#endif
    f += LOBE(LOBE_MULTISCATTER, again);
    float pdf = w.diffuse * INV_PI * wi.z;
    if (!s.is_delta) {
        f += LOBE(LOBE_SPECULAR, facets.f);
        pdf += w.specular * facets.pdf;
    }
    return Scatter(f, pdf);
}

// Samples the microfacets, which are picked with the chance `weight`; v picks reflection or refraction. The f of a
// perfectly specular sample lacks the layers.
LobeSample base_sample_facet(Surface s, vec3 wo, float v, vec2 u, float weight) {
    BaseFacet level = base_level(s, wo);
    float chance = level.chance;
    vec3 wi = bsdf_turn_back(s, base_sample(s, bsdf_turn(s, wo), v, chance, u)), f = level.reflected;
    LobeSample r = LobeSample(wi, s.is_delta, Scatter(vec3(0.0), 0.0), false);
#if HAS_TRANSMISSION
    if (wi.z < 0.0) {
        if (s.index_matched) r.is_delta = true;
        f = level.passed;
        chance = 1.0 - chance;
    }
#endif
    if (r.is_delta) r.scatter = Scatter(f, weight * chance);
    return r;
}

// A surface without other lobes, which only mirrors or refracts; u_lobe picks one of the two, where there are both each
// with a chance of at least `least`. Sets the members that path_extend reads.
LobeSample base_sample_delta(vec3 wo, bool behind, float u_lobe, float least, inout Surface s) {
    base_side(behind, s);
    BaseFacet level = base_meets(s, wo.z);
#if HAS_FILM
    float chance = level.chance;
#else
    float chance = base_chance(s, wo, wo.z, level);
#endif
#if HAS_TRANSMISSION
    if (chance > 0.0 && chance < 1.0) chance = clamp(chance, least, 1.0 - least);
#endif
    vec3 wi = base_sample(s, wo, u_lobe, chance, vec2(0.0));
    Scatter scatter = Scatter(level.reflected, chance);
#if HAS_TRANSMISSION
    if (u_lobe >= chance) scatter = Scatter(level.passed, 1.0 - chance);
#endif
    return LobeSample(wi, true, scatter, false);
}

// The share of light from wo that goes straight through a smooth surface, or through a rough one of index 1 without a
// film. It looks up no table, and sets the members that this and the layers need.
vec3 base_straight(vec3 wo, bool behind, inout Surface s) {
    base_side(behind, s);
#if HAS_FILM
    s.albedo = vec4(0.0); // nothing is reflected by facets of index 1
#endif
    return base_meets(s, wo.z).passed;
}
#endif
