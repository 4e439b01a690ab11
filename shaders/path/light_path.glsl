// A path of light: from a light towards a target, through perfectly specular events, to surfaces that have other lobes as
// well. Each of these that the camera sees directly sends its light to the pixels that it is seen in
// [Veach 1997, section 8.3.2; Arvo 1986, "Backward ray tracing"]. The path carries flux, so that the square of the index,
// by which radiance changes at a boundary, does not appear on its way: where the path comes to the camera's side of the
// surface it is that of the camera's medium, and sides_eta_scale says what it is on the other side.
//
// What media take on the way is left out; what particles turn belongs to the camera's paths.
//
// Events are counted as on the camera's path, which has one event at the surface before all others: path.bounce begins
// at 1.

#if CAUSTICS
// The ratio of cosines by which an event of a flux differs from that of radiance where the shading normal is not the
// geometric one [Veach 1997, section 5.3]; d is where the path came from, next where it goes.
float light_path_adjoint(vec3 ng, vec3 ns, vec3 d, vec3 next) {
#if HAS_SMOOTH_NORMALS || HAS_NORMAL_MAPS
    float below = dot(d, ng) * dot(next, ns);
    return below != 0.0 ? abs(dot(next, ng) * dot(d, ns) / below) : 0.0;
#else
    return 1.0;
#endif
}

// Whether the camera, with that medium around it, sees the point: a ray from there to the camera meets nothing on its way
// that the camera's ray would.
bool light_path_seen(SurfacePoint at, CameraLink link, Medium camera_medium, Sampler rng) {
    vec3 back = -link.d, o = shapes_leave(at, back);
    float left = link.t;
    bool seen, passes;
    do {
        SurfacePoint other;
        Hit hit = transparency_nearest(o, back, at.flat_id, 0u, rng, other);
        seen = hit.t >= left && budget_lasts();
        passes = false;
#if HAS_PRIORITIES
        passes = hit.t < left && budget_lasts() && medium_hides(camera_medium, other, link.d);
        left -= hit.t;
        o = shapes_leave(other, back);
        at = other;
#endif
    } while (passes);
    return seen;
}

// Sends the path's light from the surface `at`, which it has come to, to the camera.
void light_path_connect(Path path, SurfacePoint at, vec3 flux, Medium camera_medium, Sampler rng, bool odd) {
    CameraLink link = camera_link(at.p, rng);
    Path view = path;
    view.d = link.d;
    view.at = at;
    view.hit.t = link.t;
    view.bounce = 0u;
    view.medium = camera_medium;
    view.cone = cone_after(cone_begin(link.d), link.t);
    Material m;
    Interaction here = interaction_make(view, m);
    Surface s = interaction_surface(here, hues_leading(m, path.hues));
    vec3 wi = -path.d;
    Hues hues = path.hues;
    Scatter f = dispersion_eval(s, here, m, bsdf_ask(here, wi), hues);
    float across = dot(wi, here.front), side = dot(wi, here.facing);
    bool counts = link.weight > 0.0 && (here.mapped || terminator_agrees(view.at, wi, side, across));
#if HAS_HIDDEN_SHAPES
    counts = counts && (at.shape & HIDDEN) == 0u;
#endif
    vec3 c = flux * f.f * (link.weight * abs(dot(link.d, at.ng)) / abs(across));
    c *= sides_eta_scale(1.0, side, s, 0.0);
    c *= medium_share(view.medium, link.t);
    float most = max_component(c);
    counts = counts && most > 0.0 && most < INFINITY_T && !any(isnan(c));
    if (counts && light_path_seen(at, link, camera_medium, rng)) splats_take(link.at, c, odd);
}

// Takes the path on by a perfectly specular event; another one ends it.
void light_path_step(Interaction here, Material m, Sampler rng, inout Path path) {
    vec3 ng = path.at.ng, d = path.d;
    if (delta_chain_mirrors(here, m)) {
        delta_chain_step(here, m, rng, path);
    } else {
        Surface s = interaction_surface(here, hues_leading(m, path.hues));
        Asked asked;
        BsdfSample next = path_sample(s, here, rng, path, asked);
        path_weigh(dispersion_eval(s, here, m, asked, path.hues), next);
        next.valid = next.valid && next.is_delta;
        path.medium = interaction_medium(dot(here.front, next.d) < 0.0, path.medium, here.beyond);
        path_extend(next, 1.0, s, rng, path);
    }
    path.throughput *= light_path_adjoint(ng, here.basis.z, d, path.d);
}

Path light_path_begin(Emission e, Sampler rng) {
    budget_begin();
    Medium medium = medium_outside();
    if (e.placed) medium = medium_at(e.o);
    Path path = path_begin(rng, e.o, e.d, medium, 0u);
    path.at.flat_id = e.skip;
    path.bounce = 1u;
    path.cone = cone_none();
    if (!e.placed) path.throughput = medium_share(medium, INFINITY_T);
    path.alive = max_component(e.flux * path.throughput) > 0.0;
    return path;
}

// Traces one path of light.
void light_path_trace(Medium camera_medium, Sampler rng, bool odd) {
    Emission e = emission_sample(rng);
    Path path = light_path_begin(e, rng);
    if (path.alive) do {
        path.hit = transparency_nearest(path.o, path.d, path.at.flat_id, path.bounce, rng, path.at);
        path.alive = path.hit.id != NONE && budget_lasts() && path.bounce <= uniforms.max_bounces;
        if (path.alive) {
            path.throughput *= medium_share(path.medium, path.hit.t);
            path.cone = cone_after(path.cone, path.hit.t);
            SurfacePoint at = path.at;
            Material m;
            path.event = path_event(path, false);
            Interaction here = interaction_make(path, m);
            if (event_is_passage(path.event)) {
                path_pass(here, path);
                continue;
            }
            bool whole = material_is_delta(m) && !here.mapped; // it has no other lobe
            bool bent = path.bounce > 1u + path.passed; // else lights are sampled for it
            if (bent && !whole) light_path_connect(path, at, e.flux * path.throughput, camera_medium, rng, odd);
            path.alive = path.bounce < uniforms.max_bounces;
            if (path.alive) light_path_step(here, m, rng, path);
        }
    } while (path.alive);
}

// The random numbers of a pixel's path of light in the first or the second sample (`part`) of a period. All paths of the
// picture share one sequence, as any of them may come to any pixel; the two parts have one each, which are independent.
Sampler light_path_sampler(uvec2 pixel, uint period, uint part) {
    uint pixels = uniforms.resolution.x * uniforms.resolution.y, high, low;
    umulExtended(period, pixels, high, low);
    uint place = low + pixel.y * uniforms.resolution.x + pixel.x;
    if (place < low) high++;
    Sampler rng = sobol_begin(uvec2(high, 0u), place, 0x6c696768u + part);
#if !ADAPTIVE
    rng.shift = uvec2(0u);
    rng.quad = 0u;
#endif
    return rng;
}
#endif
