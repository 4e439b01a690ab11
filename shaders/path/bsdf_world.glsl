// The BSDF in world space, folded by normal maps (path/normal_map.glsl), and sampled as the estimator requires.

Scatter bsdf_eval_world(Surface s, Interaction here, vec3 wi_w) {
#if HAS_NORMAL_MAPS
    return normal_map_eval(s, here, wi_w);
#else
    return bsdf_eval(s, here.wo, basis_to_local(here.basis, wi_w));
#endif
}

// Samples a direction in the shading frame as the estimator does.
LobeSample bsdf_sample_local(Surface s, vec3 wo, float u_lobe, vec2 u) {
#if ESTIMATOR == ESTIMATOR_UNIFORM
    return bsdf_sample_uniform(s, wo, u_lobe, u);
#else
    return bsdf_sample(s, wo, u_lobe, u);
#endif
}

// The value and the density of the world direction d that `lobe` was turned into.
Scatter bsdf_scatter_world(Surface s, Interaction here, LobeSample lobe, vec3 d) {
#if HAS_NORMAL_MAPS
    Scatter scatter = normal_map_eval(s, here, d);
#else
    Scatter scatter = bsdf_eval(s, here.wo, lobe.wi);
#endif
#if ESTIMATOR == ESTIMATOR_UNIFORM
    scatter.pdf = lobe.scatter.pdf;
#endif
    if (lobe.is_delta) scatter = lobe.scatter;
    return scatter;
}
