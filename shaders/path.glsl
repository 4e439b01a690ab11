// The estimator: light carried back along one camera path. interaction.glsl tells what it has met, path_extend.glsl
// takes it on.
#include "surface.glsl"
#include "bsdf.glsl"
#include "lights.glsl"
#include "transparency.glsl"
#include "medium.glsl"
#include "arriving.glsl"
#include "facing.glsl"
#include "path_extend.glsl"
#include "interaction.glsl"
#include "delta_chain.glsl"

bool path_was_cut; // the last path: by the driver

// What a camera ray sees that meets nothing; a: whether that is shown.
#if HAS_ATTENUATION
vec4 path_sky(vec3 d, Medium medium) {
    vec3 share = medium_share(medium, INFINITY_T);
#else
vec4 path_sky(vec3 d) {
    vec3 share = vec3(1.0);
#endif
    vec4 sky = vec4(0.0);
#if HAS_ENVIRONMENT
    if (frame.environment_background != 0u)
        sky = vec4(path_clamp(share * arriving_outside(d, PDF_DELTA, false), false), 1.0);
#endif
    return sky;
}

// A path from the camera at what it meets first, `hit`; its alpha: 1: a surface, or a background that is shown.
#if HAS_ATTENUATION
float path_begin(vec3 o, vec3 d, Hit hit, SurfacePoint at, Medium medium, out Path path) {
#else
float path_begin(vec3 o, vec3 d, Hit hit, SurfacePoint at, out Path path) {
#endif
    float alpha = 0.0;
    path.d = d;
    path.hit = hit;
    path.at = at;
    path.alive = hit.id != NONE;
    path.radiance = vec3(0.0);
    path.throughput = vec3(1.0);
    path.bounce = 0u;
    if (path.alive) {
        path.radiance = arriving_emission(path.at, d) + arriving_ambient(path.at);
        alpha = 1.0;
    }
#if HAS_ENVIRONMENT || HAS_SUN_DISKS
    path.escaped = false;
    path.escaped_pdf = PDF_DELTA;
#endif
#if HAS_ENVIRONMENT
    if (!path.alive && frame.environment_background != 0u) {
        alpha = 1.0;
        path.escaped = true;
    }
#endif
    path.alive = path.alive && frame.max_bounces > 0u;
#if HAS_ATTENUATION
    path.medium = medium;
    path.throughput = medium_share(medium, path.hit.t);
    path.radiance *= path.throughput;
#endif
#if HAS_TRANSMISSION
    path.eta_scale = 1.0;
#endif
    return alpha;
}

// The light that a path finds, to its end.
vec3 path_radiance(Sampler rng, Path path) {
    vec3 before = path.radiance; // light of all bounces but the last
    if (path.alive) {
        do {
            Interaction here;
#if HAS_MIRRORS
            bool mirrored;
            do {
                here = interaction_make(path);
                mirrored = delta_chain_takes(here);
                if (mirrored) {
                    before = path.radiance;
                    delta_chain_step(here, rng, path);
                    mirrored = path.alive && path.bounce < frame.max_bounces;
                }
            } while (mirrored);
            if (!path.alive || path.bounce >= frame.max_bounces) break;
            before = path.radiance;
#else
            before = path.radiance;
            here = interaction_make(path);
#endif
            Surface s = interaction_surface(here);
            Basis basis = here.basis;
            vec3 front = here.front, wo = here.wo;
            uint pair = PAIR_BOUNCE + path.bounce * PAIRS_A_BOUNCE;
            uvec2 choice_bits = sobol_bits(rng, pair + PAIR_CHOICE);
            vec2 choice = sobol_units(choice_bits);
            uint flat_id = path.at.flat_id;
            vec3 from = path.at.p;
#if HAS_EMISSION_BOTH
            from = shapes_leave(path.at, front); // inside or outside of the very shape that shines
#endif
#if HAS_LIGHT_TREE
#if HAS_NORMAL_MAPS
            vec3 facing = here.mapped ? front : basis.z; // a lobe that folds reaches all that is in front
#else
            vec3 facing = basis.z;
#endif
#if HAS_TRANSMISSION
            LightContext context = LightContext(from, facing, surface_transmits(here.m));
#else
            LightContext context = LightContext(from, facing, false);
#endif
#else
            LightContext context = LightContext(from);
#endif
            float share = 1.0; // of a light's sample; the density of finding the light by chance counts as much less
#if HAS_LIGHTS
#if (HAS_ENVIRONMENT_IMAGE || HAS_ENVIRONMENT_CUBE) && (ESTIMATOR == ESTIMATOR_MIS || ESTIMATOR == ESTIMATOR_LIGHT)
            // More often where it is the light that is noisy: a third more time for each doubling, and a third of the
            // error of a matte ball. After the first bounce four would cost more than they tell.
            uint doublings = environment_varies() && surface_is_broad(s) ? (path.bounce == 0u ? 2u : 1u) : 0u;
            uint turn = 0u, asked = 1u << doublings;
            share = 1.0 / float(asked);
            do {
            Sampler part = sobol_part(rng, turn, doublings);
            uint pick_bits = sobol_bits(part, pair + PAIR_CHOICE).x;
#else
            Sampler part = rng;
            uint pick_bits = choice_bits.x;
#endif
            LightSample light = lights_sample(context, pick_bits, sobol_bits(part, pair + PAIR_LIGHT));
#if ESTIMATOR == ESTIMATOR_BSDF || ESTIMATOR == ESTIMATOR_UNIFORM
            bool wanted = light.pdf > 0.0 && !light.extended;
#else
            bool wanted = light.pdf > 0.0;
#endif
            vec3 wi = frame_to_local(basis, light.wi);
#if HAS_NORMAL_MAPS
            float side = here.mapped ? dot(light.wi, front) : wi.z;
            Scatter f = normal_map_eval(s, basis, wo, light.wi, front, here.mapped);
            wanted = wanted && (here.mapped || facing_agrees(wi.z, dot(light.wi, front)));
            wanted = wanted && max_component(f.f * light.radiance) > 0.0;
#else
            Scatter f = bsdf_eval(s, wo, wi);
            wanted = wanted && facing_agrees(wi.z, dot(light.wi, front)) && max_component(f.f * light.radiance) > 0.0;
#endif
#if HAS_SPHERE_LIGHTS && !HAS_EMISSION_BOTH
            wanted = wanted && light.id != path.hit.id; // rounding may put a point on a ball's inside outside of it
#endif
            float weight = 1.0;
#if ESTIMATOR == ESTIMATOR_MIS
            if (light.extended) weight = power_heuristic(light.pdf, share * f.pdf);
#endif
            if (wanted) {
                vec3 c = path.throughput * (f.f * light.radiance * (weight / light.pdf));
#if HAS_TRANSMISSION
#if HAS_NORMAL_MAPS
                c *= facing_eta_scale(path.eta_scale, side, s, light.t);
#else
                c *= facing_eta_scale(path.eta_scale, wi.z, s, light.t);
#endif
#endif
#if HAS_ATTENUATION
                bool crosses = (dot(path.at.ng, light.wi) < 0.0) != here.behind;
                c *= exp(-(crosses ? here.beyond.rate : path.medium.rate) * light.t);
#endif
                uvec2 skip = uvec2(flat_id, light.id);
#if HAS_OPACITY
                c *= transparency_share(shapes_leave(path.at, light.wi), light.wi, light.t, skip);
                bool hidden = false;
#else
                bool hidden = shapes_occluded(shapes_leave(path.at, light.wi), light.wi, light.t, skip);
#endif
                if (!hidden) path.radiance += path_clamp(c, path.bounce > 0u) * share;
            }
#if (HAS_ENVIRONMENT_IMAGE || HAS_ENVIRONMENT_CUBE) && (ESTIMATOR == ESTIMATOR_MIS || ESTIMATOR == ESTIMATOR_LIGHT)
            } while (++turn < asked);
#endif
#endif
#if ESTIMATOR == ESTIMATOR_UNIFORM
#if HAS_PRINCIPLED_LOBES
            BsdfSample picked = bsdf_pick_uniform(s, wo, choice.y, sobol_pair(rng, pair + PAIR_BSDF));
            vec3 wi_next = picked.wi;
            Scatter next = picked.scatter;
#else
            vec3 wi_next = sampling_hemisphere(sobol_pair(rng, pair + PAIR_BSDF));
            Scatter next = bsdf_eval(s, wo, wi_next);
            next.pdf = 0.5 * INV_PI;
#endif
#elif HAS_PRINCIPLED_LOBES
            BsdfSample picked = bsdf_pick(s, wo, choice.y, sobol_pair(rng, pair + PAIR_BSDF));
            vec3 wi_next = picked.wi;
#if HAS_NORMAL_MAPS
            Scatter next = picked.scatter;
#else
            Scatter next = bsdf_eval(s, wo, wi_next);
            if (picked.is_delta) next = picked.scatter;
#endif
#else
            vec3 wi_next = bsdf_sample(s, wo, choice.y, sobol_pair(rng, pair + PAIR_BSDF));
#if HAS_NORMAL_MAPS
            Scatter next = Scatter(vec3(0.0), 0.0);
#else
            Scatter next = bsdf_eval(s, wo, wi_next);
#endif
#endif
            vec3 d = frame_to_world(basis, wi_next);
#if HAS_NORMAL_MAPS
#if HAS_PRINCIPLED_LOBES
            bool certain = picked.is_delta;
#else
            bool certain = false;
#endif
#if HAS_TRANSMISSION
            bool goes = wi_next.z != 0.0 && (wi_next.z > 0.0 || s.transmission > 0.0);
#else
            bool goes = wi_next.z > 0.0;
#endif
            float lobe = wi_next.z;
#if HAS_COAT_NORMALS
            goes = goes || picked.coated;
            if (picked.coated) lobe = 1.0;
#endif
#if ESTIMATOR == ESTIMATOR_UNIFORM
            // Uniform about the surface itself, where nothing folds.
            if (here.mapped && !certain) d = frame_to_world(frame_basis(front), wi_next);
#endif
            float across = dot(d, front);
            if (here.mapped && across * lobe < 0.0) d -= 2.0 * across * front;
            Scatter folded = normal_map_eval(s, basis, wo, d, front, here.mapped);
#if ESTIMATOR == ESTIMATOR_UNIFORM
            if (!certain) next.f = folded.f;
#else
            if (!certain) next = folded;
#endif
            float side_next = here.mapped ? dot(d, front) : wi_next.z;
            path.alive = next.pdf > 0.0 && (here.mapped ? goes : facing_agrees(wi_next.z, dot(d, front)));
#else
            path.alive = next.pdf > 0.0 && facing_agrees(wi_next.z, dot(d, front));
#endif
            float found_pdf = share * next.pdf;
#if HAS_PRINCIPLED_LOBES
            if (picked.is_delta) found_pdf = PDF_DELTA;
#endif
#if ESTIMATOR != ESTIMATOR_LIGHT
            bool counts = true;
#elif HAS_PRINCIPLED_LOBES
            bool counts = picked.is_delta;
#else
            bool counts = false;
#endif
#if HAS_ATTENUATION
            interaction_cross(here, d, path);
#endif
#if HAS_NORMAL_MAPS
            path_extend(d, next, found_pdf, counts, side_next, s, rng, path);
#else
            path_extend(d, next, found_pdf, counts, wi_next.z, s, rng, path);
#endif
            float found = counts ? 1.0 : 0.0;
#if HAS_EMISSION && ESTIMATOR == ESTIMATOR_MIS
            float light_pdf = lights_pdf(path.at.light, path.hit, path.at, context, d);
            if (path.at.light != NONE) found = power_heuristic(found_pdf, light_pdf);
#endif
            path_add_emission(found, path);
        } while (path.alive && path.bounce < frame.max_bounces);
    }
#if HAS_ENVIRONMENT || HAS_SUN_DISKS
    vec3 arriving = arriving_outside(path.d, path.escaped_pdf, path.bounce > 0u);
#if HAS_TRANSMISSION
    arriving *= max(path.eta_scale, 1.0);
#endif
    if (path.escaped) path.radiance += path_clamp(path.throughput * arriving, path.bounce > 1u);
#endif
    // llvmpipe ends every loop of an invocation after 65 535 turns in all, without a word.
    path_was_cut = path.alive && path.bounce < frame.max_bounces;
    if (path_was_cut) path.radiance = before; // what the last bounce has met may not be there
    return path.radiance;
}
