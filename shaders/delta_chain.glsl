// Surfaces that only mirror or refract: no light can be asked for there, so a path goes on at once. On a machine that
// runs both sides of every `if`, a loop of their own spares all paths what only the others need.
#if HAS_MIRRORS
bool delta_chain_takes(Interaction here) {
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
void delta_chain_step(Interaction here, Sampler rng, inout Path path) {
    Surface s = surface_make(here.m, here.tangent);
    principled_side(here.behind, s);
    float u = sobol_pair(rng, PAIR_BOUNCE + path.bounce * PAIRS_A_BOUNCE + PAIR_CHOICE).y;
    float chance = microfacet_reflect_chance(s, here.wo.z);
    Scatter next = Scatter(microfacet_fresnel(s, here.wo.z), chance);
#if HAS_TRANSMISSION
    if (u >= chance) next = Scatter(microfacet_transmittance(s, here.wo.z), 1.0 - chance);
#endif
    vec3 wi = microfacet_sample(s, here.wo, u, vec2(0.0));
    vec3 d = frame_to_world(here.basis, wi);
    path.alive = next.pdf > 0.0 && facing_agrees(wi.z, dot(d, here.front));
#if HAS_ATTENUATION
    interaction_cross(here, d, path);
#endif
    path_extend(d, next, PDF_DELTA, true, wi.z, s, rng, path);
    path_add_emission(1.0, path);
}
#endif
