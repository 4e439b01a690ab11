// The one place where a path's rays are traced, those of the camera among them: drivers copy the walk through the scene
// to each place that calls it, and took up to half as long again to compile a kernel with a place for each kind of ray.

// Adds the emission of the surface that the path has come to, and its ambient light.
void path_add_emission(inout Path path) {
#if HAS_EMISSION
    vec3 arriving = arriving_emission(path.at, path.d) * direct_found_weight(path) * path.eta_scale;
    if (path.hit.id != NONE) path.radiance += path_clamp(path.throughput * arriving, path.bounce > 1u);
#endif
#if HAS_AMBIENT
    vec3 ambient = arriving_ambient(path.at) * path.eta_scale;
    if (path.hit.id != NONE) path.radiance += path_clamp(path.throughput * ambient, path.bounce > 1u);
#endif
}

// Follows the path's ray to what it meets, and adds what shines there.
void path_trace(Sampler rng, inout Path path) {
    path.hit = transparency_nearest(path.o, path.d, path.at.flat_id, path.bounce, rng, path.at);
    bool met = path.hit.id != NONE;
    path.throughput *= medium_share(path.medium, path.hit.t);
    path.escaped = !met && path.counts && (path.bounce > 0u || arriving_background());
    path.alive = met && path.bounce < frame.max_bounces;
    if (path.bounce == 0u) path.alpha = met || path.escaped ? 1.0 : 0.0;
    path_add_emission(path);
    path.radiance_before = path.radiance;
}
