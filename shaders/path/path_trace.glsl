// Tracing a path's rays, camera rays included. Drivers inline the walk through the scene at each call: a kernel with a tree
// or with mirrors calls it once, at the beginning of a bounce, and compiles in half to nine tenths of the time. Where the
// walk is short there is a second call, for the camera, and rays are traced ahead, at the end of a bounce: llvmpipe leaves
// a loop only at its end, so tracing first would cost one fully masked shading pass, 3 to 9 % of a Cornell box's time.

#if HAS_PRIORITIES
// Takes the path past a boundary that is not there.
void path_pass(Interaction here, inout Path path) {
    path.medium = here.beyond;
    path.o = shapes_leave(path.at, path.d);
    path.travelled += path.hit.t;
}
#endif

// Adds the emission and the ambient light of the surface that the path has reached.
void path_add_emission(inout Path path) {
#if HAS_EMISSION
    // Where a light may have been sampled instead, both must find the same radiance: that of the point.
    Cone cone = cone_none();
    if (path.found_pdf >= PDF_DELTA) cone = path.cone;
    vec3 arriving = found_light_emission(path.at, path.d, cone) * direct_found_weight(path) * path.eta_scale;
    bool shows = path.hit.id != NONE && !path_passes(path) && !walk_under(path);
    if (shows) path.radiance += path_clamp(path.throughput * arriving, path.bounce > 1u + path.passed);
#endif
#if HAS_AMBIENT
    vec3 ambient = found_light_ambient(path.at, path.d, path.cone) * path.eta_scale;
    bool ambient_shows = path.hit.id != NONE && !scatter_was(path) && !path_passes(path) && !walk_under(path);
    if (ambient_shows) path.radiance += path_clamp(path.throughput * ambient, path.bounce > 1u + path.passed);
#endif
}

// Traces the path's ray, and adds the emission of the surface that it hits, or the light from infinity.
void path_trace(Sampler rng, inout Path path) {
    path.hit = transparency_nearest(path.o, path.d, path.at.flat_id, path.bounce, rng, path.at);
    path.alive = path.alive && budget_lasts();
    if (!path.alive) path.hit.id = NONE; // the last surface has ended it, or this ray its budget
    if (!walk_goes_on(path)) path.medium = medium_again(path.medium);
    scatter_travel(rng, path);
    bool met = path.hit.id != NONE;
    path.cone = cone_after(path.cone, path.hit.t);
#if HAS_WALKS
    walk_arrive(path);
#endif
    path.escaped = path.alive && !met && !walk_goes_on(path) && path.counts && (path.bounce > 0u || found_light_background());
    path.alive = met && path.bounce < uniforms.max_bounces;
#if HAS_WALKS
    path.alive = met && (path.walks || path.bounce < uniforms.max_bounces + path.walked) && path.steps < WALK_STEPS;
#endif
#if HAS_PRIORITIES
    path.passes = met && !scatter_was(path) && medium_hides(path.medium, path.at, path.d);
    path.alive = path.alive || path.passes;
#endif
    if (path.bounce == 0u) path.alpha = met || path.escaped ? 1.0 : 0.0;
    path_add_emission(path);
    path.radiance_before = path.radiance;
}

// Follows a ray at the end of the bounce where it begins, and that of the camera, in kernels that follow rays ahead.
void path_trace_ahead(Sampler rng, inout Path path) {
#if !ANY_CHAINS
    path_trace(rng, path);
#endif
}
