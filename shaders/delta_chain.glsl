// Surfaces that only mirror or refract: no light can be sampled there, so a path goes on at once. On a machine that
// runs both sides of every `if`, a loop of their own saves such paths the work that only other surfaces need.

#if HAS_MIRRORS
// Whether a surface only mirrors or refracts.
bool delta_chain_takes(Interaction here) {
    Material m = here.m;
    bool whole = m.metallic >= 1.0;
#if HAS_TRANSMISSION
    whole = whole || m.transmission >= 1.0;
#endif
    return whole && !here.mapped && m.model == MODEL_PRINCIPLED && m.roughness < SURFACE_LEAST_ROUGHNESS
        && m.clearcoat <= 0.0 && m.sheen <= 0.0;
}

// Scatters as principled_sample does where there is no other lobe to pick.
void delta_chain_step(Interaction here, Sampler rng, inout Path path) {
    Surface s = surface_make(here.m, here.tangent);
    principled_side(here.behind, s);
    float u = sobol_pair(rng, sobol_bounce_pair(path.bounce) + PAIR_CHOICE).y;
    float chance = microfacet_reflect_chance(s, here.wo.z);
    vec3 wi = microfacet_sample(s, here.wo, u, vec2(0.0));
    BsdfSample next;
    next.d = frame_to_world(here.basis, wi);
    next.scatter = Scatter(microfacet_fresnel(s, here.wo.z), chance);
#if HAS_TRANSMISSION
    if (u >= chance) next.scatter = Scatter(microfacet_transmittance(s, here.wo.z), 1.0 - chance);
#endif
    next.side = wi.z;
    next.is_delta = true;
    next.valid = next.scatter.pdf > 0.0 && facing_agrees(wi.z, dot(next.d, here.front));
    interaction_cross(here, next.d, path);
    path_extend(next, 1.0, s, rng, path);
    path_add_emission(1.0, path);
}
#endif

// Takes a path on to the first surface that does more, or to the path's end. Returns the last surface that it meets.
Interaction delta_chain(Sampler rng, inout Path path) {
    Interaction here;
#if HAS_MIRRORS
    bool taken;
    do {
        path.radiance_before = path.radiance;
        here = interaction_make(path);
        taken = delta_chain_takes(here);
        if (taken) {
            delta_chain_step(here, rng, path);
            taken = path_continues(path);
        }
    } while (taken);
#else
    path.radiance_before = path.radiance;
    here = interaction_make(path);
#endif
    return here;
}

// Whether delta_chain has ended the path.
bool delta_chain_ended(Path path) {
#if HAS_MIRRORS
    return !path_continues(path);
#else
    return false;
#endif
}
