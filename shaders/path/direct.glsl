// Next event estimation: lights are sampled at each surface and weighted against paths that find them by chance
// [Veach 1997, section 9.2.4].

// The point for which lights are sampled; `front` is the geometric normal on the viewer's side.
LightContext direct_context(SurfacePoint at, vec3 front, vec3 facing, bool transmits) {
    vec3 p = at.p;
#if HAS_EMISSION_BOTH
    p = shapes_leave(at, front); // on its side of the surface, which may belong to a light
#endif
    return LightContext(p, facing, transmits);
}

// How often the lights are sampled at one surface, as a power of two. Surfaces whose noise comes from the light take
// more samples: a doubling costs a third more time and leaves a third of a matte ball's error. After the first bounce
// four samples would cost more than they are worth.
uint direct_doublings(Surface s, uint bounce) {
#if HAS_ENVIRONMENT_IMAGE || HAS_ENVIRONMENT_CUBE
    bool samples_lights = ESTIMATOR == ESTIMATOR_MIS || ESTIMATOR == ESTIMATOR_LIGHT;
    return samples_lights && environment_varies() && surface_is_broad(s) ? (bounce == 0u ? 2u : 1u) : 0u;
#else
    return 0u;
#endif
}

// The share of each of these samples in their mean; the density of finding the light by chance counts that much less.
float direct_share(Surface s, uint bounce) { return 1.0 / float(1u << direct_doublings(s, bounce)); }

// Whether the estimator counts that sample of a light, at a surface of the shape `id`.
bool direct_counts(LightSample light, uint id) {
    bool counts = light.pdf > 0.0;
    if (ESTIMATOR == ESTIMATOR_BSDF || ESTIMATOR == ESTIMATOR_UNIFORM) counts = counts && !light.extended;
#if HAS_SPHERE_LIGHTS && !HAS_EMISSION_BOTH
    counts = counts && light.id != id; // rounding may put a point on the inside of a ball outside of it
#endif
    return counts;
}

// The weight of a light's sample; found_pdf is the density with which the BSDF would have given its direction.
float direct_weight(LightSample light, float found_pdf) {
    return ESTIMATOR == ESTIMATOR_MIS && light.extended ? power_heuristic(light.pdf, found_pdf) : 1.0;
}

// The weight of emission that the path has found by chance.
float direct_found_weight(Path path) {
    float weight = path.counts && !caustics_leave_out(path) ? 1.0 : 0.0;
#if HAS_EMISSION
    if (ESTIMATOR == ESTIMATOR_MIS && path.at.light != NONE && path.found_pdf < PDF_DELTA) {
        Hit hit = path.hit;
        hit.t += path.travelled; // from the surface where lights were sampled
        float light_pdf = lights_pdf(path.at.light, hit, path.at, path.lit, path.d);
        weight = power_heuristic(path.found_pdf, light_pdf);
    }
#endif
    return weight;
}

// Whether the light is visible; c loses what is lost on the way through `medium` and what surfaces there take. The ray
// goes straight through as many of them as a path may that goes there, as each is a bounce of that path.
bool direct_arrives(Path path, LightSample light, Medium medium, inout vec3 c) {
    uvec2 skip = uvec2(terminator_skip(path.at, light.wi), light.id);
    vec3 o, d;
    float t;
    terminator_aim(path.at, light, o, d, t);
    return shadow_arrives(o, d, t, skip, medium, uniforms.max_bounces - 1u - path.bounce, c);
}

// A sample of the lights, which of `share` may be the turn-th.
LightSample direct_sample(LightContext context, Sampler rng, uint bounce) {
    uint pair = sobol_bounce_pair(bounce);
    return lights_sample(context, sobol_bits(rng, pair + PAIR_CHOICE).x, sobol_bits(rng, pair + PAIR_LIGHT));
}

// Adds the light of one sample of one light, towards which the BSDF is f.
void direct_add(Surface s, Interaction here, LightSample light, Scatter f, float share, inout Path path) {
    float across = dot(light.wi, here.front), side = dot(light.wi, here.facing);
    bool counts = direct_counts(light, path.hit.id) && (here.mapped || terminator_agrees(path.at, light.wi, side, across))
        && max_component(f.f * light.radiance) > 0.0;
    float weight = direct_weight(light, share * f.pdf);
    if (counts) {
        vec3 c = path.throughput * (f.f * light.radiance * (weight / light.pdf));
        c *= sides_eta_scale(path.eta_scale, side, s, light.t);
        Medium medium = medium_again(interaction_medium(across < 0.0, path.medium, here.beyond));
        if (direct_arrives(path, light, medium, c)) path.radiance += path_clamp(c, path.bounce > path.passed) * share;
    }
}
