// Surfaces that only mirror or refract: no light can be sampled there, so a path goes on at once. On a machine that
// runs both sides of every `if`, a loop of their own saves such paths the work that only other surfaces need.

// Whether the surface does nothing but mirror or refract.
bool delta_chain_mirrors(Interaction here, Material m) {
#if HAS_MIRRORS
    return material_is_delta(m) && !here.mapped;
#else
    return false;
#endif
}

// Scatters as bsdf_sample does where there is no other lobe to pick.
void delta_chain_step(Interaction here, Material m, Sampler rng, inout Path path) {
#if HAS_MIRRORS
    Surface s = surface_make(interaction_material(here, hues_leading(m, path.hues)), here.tangent);
    float u = sobol_pair(rng, sobol_bounce_pair(path.bounce) + PAIR_CHOICE).y;
    LobeSample lobe = dispersion_sample_delta(here, m, u, path.bounce == 0u ? uniforms.glint_chance : 0.0, s, path.hues);
    BsdfSample next;
    next.d = basis_to_world(here.basis, lobe.wi);
    next.scatter = lobe.scatter;
    next.side = lobe.wi.z;
    next.is_delta = true;
    next.enters = false;
    next.straight = lobe.wi.z < 0.0 && straight_goes(s, path.at);
    next.valid = next.scatter.pdf > 0.0 && terminator_agrees(path.at, next.d, lobe.wi.z, dot(next.d, here.front));
    path.medium = interaction_medium(dot(here.front, next.d) < 0.0, path.medium, here.beyond);
    path_extend(next, 1.0, s, rng, path);
#endif
}

// Takes a path on to the first surface that does more; false where the path ends on the way.
bool delta_chain(Sampler rng, inout Path path, out Interaction here, out Material m) {
#if !ANY_CHAINS
    here = interaction_make(path, m);
    return true;
#else
    bool taken;
    do {
        // Else the surface before this ray would be in registers while that is traced: the ray may find none to replace it.
        here = interaction_none();
        m = material_none();
        path_trace(rng, path);
        taken = false;
        if (path.alive) {
            here = interaction_make(path, m);
            bool passes = event_is_passage(path.event), turns = walk_goes_on(path) && !passes;
            bool mirrors = path.event == EVENT_SURFACE && delta_chain_mirrors(here, m);
            if (passes) path_pass(here, path);
            if (turns) walk_turn(rng, path);
            if (mirrors) delta_chain_step(here, m, rng, path);
            taken = passes || turns || mirrors;
        }
    } while (taken && path.alive);
    return path.alive;
#endif
}
