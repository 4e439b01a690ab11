// Tracing a path's rays, camera rays included. Drivers inline the walk through the scene at each call: a kernel with a tree
// or with mirrors calls it once, at the beginning of a bounce, and compiles in half to nine tenths of the time. Where the
// walk is short there is a second call, for the camera, and rays are traced ahead, at the end of a bounce: llvmpipe leaves
// a loop only at its end, so tracing first would cost one fully masked shading pass, 3 to 9 % of a Cornell box's time.

// The event that the path's ray has ended with; `scattered` is what scatter_travel says. The order matters:
// - Of a ray that meets a particle, `path.at` is the particle, and no surface may be asked for.
// - A walk is in the medium of its surface alone, where nothing is known of bodies: it leaves by that surface, and all others are
//   not there for it.
// - The bodies around the ray say last whether the surface is there.
uint path_event(Path path, bool scattered) {
    if (path.hit.id == NONE) return path.alive && !walk_goes_on(path) ? EVENT_ESCAPE : EVENT_NONE;
    if (scattered) return EVENT_PARTICLE;
    if (walk_goes_on(path)) return walk_leaves(path) ? EVENT_EXIT : EVENT_PASSAGE;
    return medium_hides(path.medium, path.at, path.d) ? EVENT_PASSAGE : EVENT_SURFACE;
}

// Whether the path may go on from there. A walk counts its steps, all other paths their bounces, among which a whole walk
// is none, nor is a boundary that is not there.
bool path_may_go_on(Path path) {
    if (walk_goes_on(path)) return walk_lasts(path);
    return event_is_passage(path.event) || path.bounce < uniforms.max_bounces + walk_count(path);
}

// Takes the path past a surface that is not there.
void path_pass(Interaction here, inout Path path) {
    path.medium = here.beyond;
    path.o = shapes_leave(path.at, path.d);
    path.travelled += path.hit.t;
}

// Adds the emission and the ambient light of the surface that the path has reached.
void path_add_emission(inout Path path) {
#if HAS_EMISSION
    // Where a light may have been sampled instead, both must find the same radiance: that of the point.
    Cone cone = cone_none();
    if (path.found_pdf >= PDF_DELTA) cone = path.cone;
    vec3 arriving = found_light_emission(path.at, path.d, cone) * direct_found_weight(path) * path.eta_scale;
    if (path.event == EVENT_SURFACE) path.radiance += path_clamp(path.throughput * arriving, path.bounce > 1u + path.passed);
#endif
#if HAS_AMBIENT
    vec3 ambient = found_light_ambient(path.at, path.d, path.cone) * path.eta_scale;
    if (path.event == EVENT_SURFACE) path.radiance += path_clamp(path.throughput * ambient, path.bounce > 1u + path.passed);
#endif
}

// Traces the path's ray, and adds the emission of the surface that it hits, or the light from infinity.
void path_trace(Sampler rng, inout Path path) {
    path.hit = transparency_nearest(path.o, path.d, path.at.flat_id, path.bounce, rng, path.at);
    path.alive = path.alive && budget_lasts();
    if (!path.alive) path.hit.id = NONE; // the last surface has ended it, or this ray its budget
    if (!walk_goes_on(path)) path.medium = medium_again(path.medium);
    bool scattered = scatter_travel(rng, path), met = path.hit.id != NONE;
    path.cone = cone_after(path.cone, path.hit.t);
    path.event = path_event(path, scattered);
    walk_arrive(path);
    path.alive = met && path_may_go_on(path);
    bool background = path.event == EVENT_ESCAPE && found_light_background();
    if (path.bounce == 0u) path.alpha = met || background ? 1.0 : 0.0;
    path_add_emission(path);
    path.radiance_before = path.radiance;
}

// Follows a ray at the end of the bounce where it begins, and that of the camera, in kernels that follow rays ahead.
void path_trace_ahead(Sampler rng, inout Path path) {
#if !ANY_CHAINS
    path_trace(rng, path);
#endif
}
