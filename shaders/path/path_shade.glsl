// Adds the light that the surface receives from lights and sends on along the path; returns the direction in which the path
// goes on. The BSDF is asked for that one first: what is known of it alone takes no registers while rays go to lights.
// With SHADE_ONCE it is asked for all directions at one place of the program: drivers inline each call, so that LLVM takes
// a sixth less time for a kernel, and less than half where the BSDF has a film or many models.
BsdfSample path_shade(Surface s, Interaction here, Material m, LightContext context, float share, Sampler rng,
                      inout Path path) {
    Asked asked;
    BsdfSample next = path_sample(s, here, rng, path, asked);
#if HAS_LIGHTS && SHADE_ONCE
    uint doublings = direct_doublings(s, path.bounce), turn = 0u;
    bool own = true;
    LightSample light;
    do {
        Scatter f = dispersion_eval(s, here, m, asked, path.hues);
        if (own) path_weigh(f, next);
        // As loops, because llvmpipe runs the body of an `if` for rays that need it no longer, too.
        for (bool adds = !own; adds; adds = false) direct_add(s, here, light, f, share, path);
        // Nothing of this turn is in registers in the next one.
        light = lights_none();
        asked = Asked(vec3(0.0), vec3(0.0), false, bsdf_rough_sample(vec3(0.0)));
        for (bool picks = turn < (1u << doublings); picks; picks = false) {
            light = direct_sample(context, sobol_part(rng, turn, doublings), path.bounce);
            asked = bsdf_ask(here, light.wi);
        }
        own = false;
    } while (turn++ < (1u << doublings));
#else
    path_weigh(dispersion_eval(s, here, m, asked, path.hues), next);
#if HAS_LIGHTS
    uint doublings = direct_doublings(s, path.bounce), turn = 0u;
    // No loop where it has one turn: RADV keeps it all the same, and what it reads in registers to its end.
#if HAS_ENVIRONMENT_IMAGE || HAS_ENVIRONMENT_CUBE
    do {
#endif
        LightSample light = direct_sample(context, sobol_part(rng, turn, doublings), path.bounce);
        Scatter f = dispersion_eval(s, here, m, bsdf_ask(here, light.wi), path.hues);
        direct_add(s, here, light, f, share, path);
#if HAS_ENVIRONMENT_IMAGE || HAS_ENVIRONMENT_CUBE
    } while (++turn < (1u << doublings));
#endif
#endif
#endif
    return next;
}
