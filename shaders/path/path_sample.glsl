// The direction in which the path goes on from the surface s; `asked` is what the BSDF has to be asked for it.
BsdfSample path_sample(Surface s, Interaction here, Sampler rng, Path path, out Asked asked) {
    uint pair = sobol_bounce_pair(path.bounce);
    float u_lobe = sobol_pair(rng, pair + PAIR_CHOICE).y;
    LobeSample lobe = bsdf_sample_local(s, here.wo, u_lobe, sobol_pair(rng, pair + PAIR_BSDF));
    BsdfSample r;
    r.d = normal_map_direction(here, lobe);
    r.scatter = lobe.scatter;
    r.side = here.mapped ? dot(r.d, here.fold) : lobe.wi.z;
    r.is_delta = lobe.is_delta;
    r.enters = bsdf_enters(lobe);
    r.straight = lobe.is_delta && lobe.wi.z < 0.0 && !lobe.coated && straight_goes(s, path.at);
    float across = dot(r.d, here.front);
    r.valid = here.mapped ? normal_map_keeps(s, lobe) : terminator_agrees(path.at, r.d, lobe.wi.z, across);
    if (r.enters) {
        r.d = path.d;
        r.side = 1.0; // radiance is as it is outside
        r.valid = true;
    }
    asked = Asked(r.d, lobe.wi, true, lobe);
    return r;
}

// Takes over what the BSDF is there.
void path_weigh(Scatter scatter, inout BsdfSample next) {
    next.scatter = scatter;
    next.valid = next.valid && scatter.pdf > 0.0;
}
