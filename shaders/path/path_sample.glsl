// The direction in which the path goes on from the surface s.
BsdfSample path_sample(Surface s, Interaction here, Material m, Sampler rng, inout Path path) {
    uint pair = sobol_bounce_pair(path.bounce);
    float u_lobe = sobol_pair(rng, pair + PAIR_CHOICE).y;
    LobeSample lobe = bsdf_sample_local(s, here.wo, u_lobe, sobol_pair(rng, pair + PAIR_BSDF));
    BsdfSample r;
    r.d = normal_map_direction(here, lobe);
    r.scatter = dispersion_scatter(s, here, m, lobe, r.d, path.hues);
    r.side = here.mapped ? dot(r.d, here.fold) : lobe.wi.z;
    r.is_delta = lobe.is_delta;
    r.straight = lobe.is_delta && lobe.wi.z < 0.0 && !lobe.coated && straight_goes(s, path.at);
    float across = dot(r.d, here.front);
    bool agrees = here.mapped ? normal_map_keeps(s, lobe) : terminator_agrees(path.at, r.d, lobe.wi.z, across);
    r.valid = r.scatter.pdf > 0.0 && agrees;
    return r;
}
