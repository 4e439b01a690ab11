// The BSDF in world space, folded by normal maps (path/normal_map.glsl), and sampled as the estimator requires.

// A direction for which the BSDF is asked: that of a lamp, or the one in which the path goes on.
struct Asked {
    vec3 d;          // in world space
    vec3 wi;         // in the shading frame, where nothing is folded
    bool goes_on;    // the path has drawn it ...
    LobeSample lobe; // ... by this sample
};

Asked bsdf_ask(Interaction here, vec3 d) {
    return Asked(d, basis_to_local(here.basis, d), false, bsdf_rough_sample(vec3(0.0)));
}

// Samples a direction in the shading frame as the estimator does.
LobeSample bsdf_sample_local(Surface s, vec3 wo, float u_lobe, vec2 u) {
    LobeSample lobe = bsdf_sample(s, wo, u_lobe, u);
    if (ESTIMATOR == ESTIMATOR_UNIFORM) bsdf_make_uniform(s, wo, u, lobe);
    return lobe;
}

// The value and the density of a direction.
Scatter bsdf_eval_world(Surface s, Interaction here, Asked asked) {
#if HAS_NORMAL_MAPS
    Scatter scatter = normal_map_eval(s, here, asked.d);
#else
    Scatter scatter = bsdf_eval(s, here.wo, asked.wi);
#endif
    if (ESTIMATOR == ESTIMATOR_UNIFORM && asked.goes_on) scatter.pdf = asked.lobe.scatter.pdf;
    if (asked.goes_on && (asked.lobe.is_delta || bsdf_enters(asked.lobe))) scatter = asked.lobe.scatter;
    return scatter;
}
