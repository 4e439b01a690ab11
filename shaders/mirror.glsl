// Surfaces that only mirror or refract: no light can be asked for there, so a path goes on at once. On a machine that
// runs both sides of every `if`, a loop of their own spares all paths what only the others need.
#if HAS_MIRRORS
bool mirror_only(Met here) {
    Material m = here.m;
    bool whole = m.metallic >= 1.0;
#if HAS_TRANSMISSION
    whole = whole || m.transmission >= 1.0;
#endif
#if HAS_NORMAL_MAPS
    whole = whole && !here.mapped;
#endif
    return whole && m.model == MODEL_PRINCIPLED && m.roughness < SURFACE_LEAST_ROUGHNESS && m.clearcoat <= 0.0
        && m.sheen <= 0.0;
}

// As principled_sample does it where there is nothing else to pick.
void mirror_step(Met here, Sampler rng, inout Path path) {
    Surface s = surface_make(here.m, here.tangent);
    principled_side(here.behind, s);
    float u = sobol_pair(rng, PAIR_BOUNCE + path.bounce * PAIRS_A_BOUNCE + PAIR_CHOICE).y;
    float chance = facets_choice(s, here.wo.z);
    Scatter next = Scatter(facets_fresnel(s, here.wo.z), chance);
#if HAS_TRANSMISSION
    if (u >= chance) next = Scatter(facets_through(s, here.wo.z), 1.0 - chance);
#endif
    vec3 wi = facets_sample(s, here.wo, u, vec2(0.0));
    vec3 d = frame_to_world(here.basis, wi);
    path.alive = next.pdf > 0.0 && facing_agrees(wi.z, dot(d, here.front));
#if HAS_ATTENUATION
    meet_crossing(here, d, path);
#endif
    step_on(d, next, PATH_CERTAIN, true, wi.z, s, rng, path);
    step_gather(1.0, path);
}
#endif
