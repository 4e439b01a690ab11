// Adds the light that the surface receives from lights and sends on along the path; returns the direction in which the path
// goes on. With SHADE_ONCE the BSDF is asked for all directions at one place of the program: drivers inline each call, so
// that LLVM takes a sixth less time for a kernel, and less than half where the BSDF has a film or many models.
BsdfSample path_shade(Surface s, Interaction here, Material m, LightContext context, float share, Sampler rng,
                      inout Path path) {
    Asked own;
    BsdfSample next = path_sample(s, here, rng, path, own);
#if HAS_LIGHTS && SHADE_ONCE
    uint doublings = direct_doublings(s, path.bounce), turn = 0u;
    bool more;
    do {
        more = turn < (1u << doublings);
        Asked asked = own;
        LightSample light;
        // As loops, because llvmpipe runs the body of an `if` for rays that need it no longer, too.
        for (bool picks = more; picks; picks = false) {
            light = direct_sample(context, sobol_part(rng, turn, doublings), path.bounce);
            asked = bsdf_ask(here, light.wi);
        }
        Scatter f = dispersion_eval(s, here, m, asked, path.hues);
        for (bool adds = more; adds; adds = false) direct_add(s, here, light, f, share, path);
        if (!more) path_weigh(f, next);
        turn++;
    } while (more);
#else
#if HAS_LIGHTS
    uint doublings = direct_doublings(s, path.bounce), turn = 0u;
    do {
        LightSample light = direct_sample(context, sobol_part(rng, turn, doublings), path.bounce);
        Scatter f = dispersion_eval(s, here, m, bsdf_ask(here, light.wi), path.hues);
        direct_add(s, here, light, f, share, path);
    } while (++turn < (1u << doublings));
#endif
    path_weigh(dispersion_eval(s, here, m, own, path.hues), next);
#endif
    return next;
}
