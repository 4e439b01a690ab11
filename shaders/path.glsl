// The estimator: light carried back along one camera path. With facing.glsl and frame.glsl the only
// place that changes space.
#include "surface.glsl"
#include "bsdf.glsl"
#include "lights.glsl"
#include "passing.glsl"
#include "medium.glsl"
#include "arriving.glsl"
#include "facing.glsl"

struct Radiance {
    vec3 color;
    float alpha; // 1: met a surface, or a background that is shown
};

// Of a new path's throughput: a path that carries less may end by chance. Below 1, for the variance of ending paths costs
// more than the time they take: 1/2 leaves a sixth less error after equal time in a white box, a third by glass.
const float PATH_WORTH = 0.5;
// Stands for the density of a direction that only a mirror could have taken.
const float PATH_CERTAIN = 1e30;

bool path_was_cut; // of the last path: by the driver

vec3 path_clamp(vec3 c, bool indirect) {
#if HAS_CLAMP
    float m = max_component(c);
    if (indirect && m > frame.clamp_radiance) c *= frame.clamp_radiance / m;
#endif
    return c;
}

#if HAS_ATTENUATION
Radiance path_trace(vec3 o, vec3 d, Sampler rng, Medium medium) {
#else
Radiance path_trace(vec3 o, vec3 d, Sampler rng) {
#endif
    Radiance result = Radiance(vec3(0.0), 0.0);
    Point at;
    Nearest n = passing_nearest(o, d, NONE, 0u, rng, at);
    bool alive = n.id != NONE;
    if (alive) {
        result = Radiance(arriving_emission(at, d) + arriving_ambient(at), 1.0);
    }
#if HAS_ENVIRONMENT || HAS_SUN_DISKS
    // A path leaves the scene once at most: what arrives from there is asked for once, when all its neighbours ended.
    bool left = false;
    float left_pdf = PATH_CERTAIN;
#endif
#if HAS_ENVIRONMENT
    if (!alive && frame.environment_background != 0u) {
        result.alpha = 1.0;
        left = true;
    }
#endif
    alive = alive && frame.max_bounces > 0u;
    vec3 throughput = vec3(1.0);
#if HAS_ATTENUATION
    throughput = medium_share(medium, n.t);
    result.color *= throughput;
#endif
    vec3 before = result.color; // light of all bounces but the last
    uint bounce = 0u;
#if HAS_TRANSMISSION
    // Radiance over the square of the index is what passes a boundary unchanged: `dense` is that square here over
    // that at the camera, kept apart so that roulette does not see it.
    float dense = 1.0;
#endif
    if (alive) {
        do {
            before = result.color;
            vec3 wo_w = -d;
            vec3 front = dot(at.ng, wo_w) < 0.0 ? -at.ng : at.ng;
#if HAS_TEXTURES
            vec4 texels[max(TEXTURE_SURFACE_SLOTS, 1)];
            texture_look(at, texels);
#endif
#if HAS_COAT_NORMALS
            Point coat_at = at;
            bool coat_mapped = texture_coat_normal(at, texels, coat_at.ns);
#endif
#if HAS_NORMAL_MAPS
            bool mapped = texture_normal(at, texels, at.ns);
#endif
#if HAS_COAT_NORMALS
            mapped = mapped || coat_mapped;
#endif
            Basis basis = frame_basis(facing_normal(at, wo_w));
            vec2 tangent = vec2(1.0, 0.0);
#if HAS_ANISOTROPIC
            vec2 along = vec2(dot(at.tangent, basis.x), dot(at.tangent, basis.y));
            float along2 = dot(along, along);
            if (along2 > 0.0) tangent = along * inversesqrt(along2);
#endif
#if HAS_TEXTURES
            Material m = texture_material(at, texels);
#else
            Material m = material_pick(at.material);
#endif
#if HAS_ANISOTROPIC
            // From u towards v, from whichever side it is seen: else a body's inside would not be its outside's mirror.
            m.anisotropic_rotation *= dot(at.ng, wo_w) < 0.0 ? -at.handed : at.handed;
#endif
            Surface s = surface_make(m, tangent);
            vec3 wo = frame_to_local(basis, wo_w);
#if HAS_COAT_NORMALS
            s.coat = frame_basis(frame_to_local(basis, facing_normal(coat_at, wo_w)));
#endif
#if HAS_PRINCIPLED
            principled_face(wo, dot(at.ng, wo_w) < 0.0, s);
#endif
#if HAS_ATTENUATION
            vec3 rate = surface_attenuation(m);
            bool clear = surface_transmits(m), inside = dot(at.ng, wo_w) < 0.0;
            if (clear && inside && medium.depth < 0.5) {
                // The back of an open sheet: as if there had been a body all along.
                medium = medium_entered(medium, rate);
                if (bounce == 0u) throughput = medium_share(medium, n.t);
            }
            Medium beyond = medium;
            if (clear && inside) beyond = medium_left(medium, rate);
            if (clear && !inside) beyond = medium_entered(medium, rate);
#endif
            uint pair = PAIR_BOUNCE + bounce * PAIRS_A_BOUNCE;
            uvec2 choice_bits = sobol_bits(rng, pair + PAIR_CHOICE);
            vec2 choice = sobol_units(choice_bits);
            uint flat_id = at.flat_id;
            vec3 from = at.p;
#if HAS_EMISSION_BOTH
            from = shapes_leave(at, front); // inside or outside of the very shape that shines
#endif
#if HAS_LIGHT_TREE
#if HAS_NORMAL_MAPS
            vec3 facing = mapped ? front : basis.z; // a lobe that folds reaches all that is in front
#else
            vec3 facing = basis.z;
#endif
#if HAS_TRANSMISSION
            Asker asker = Asker(from, facing, surface_transmits(m));
#else
            Asker asker = Asker(from, facing, false);
#endif
#else
            Asker asker = Asker(from);
#endif
            float share = 1.0; // of a light's sample; the density of finding the light by chance counts as much less
#if HAS_LIGHTS
#if (HAS_ENVIRONMENT_IMAGE || HAS_ENVIRONMENT_CUBE) && (ESTIMATOR == ESTIMATOR_MIS || ESTIMATOR == ESTIMATOR_LIGHT)
            // Twice where it is the light that is noisy: a quarter more time, for half the error of a matte ball.
            uint twice = environment_varies() && surface_is_broad(s) ? 1u : 0u, turn = 0u;
            if (twice != 0u) share = 0.5;
            do {
            Sampler part = sobol_part(rng, turn, twice);
            uint pick_bits = sobol_bits(part, pair + PAIR_CHOICE).x;
#else
            Sampler part = rng;
            uint pick_bits = choice_bits.x;
#endif
            LightSample light = lights_sample(asker, pick_bits, sobol_bits(part, pair + PAIR_LIGHT));
#if ESTIMATOR == ESTIMATOR_BSDF || ESTIMATOR == ESTIMATOR_UNIFORM
            bool wanted = light.pdf > 0.0 && !light.extended;
#else
            bool wanted = light.pdf > 0.0;
#endif
            vec3 wi = frame_to_local(basis, light.wi);
#if HAS_NORMAL_MAPS
            float side = mapped ? dot(light.wi, front) : wi.z;
            Scatter f = facing_folded(s, basis, wo, light.wi, front, mapped);
            wanted = wanted && (mapped || facing_agrees(wi.z, dot(light.wi, front)));
            wanted = wanted && max_component(f.f * light.radiance) > 0.0;
#else
            Scatter f = bsdf_eval(s, wo, wi);
            wanted = wanted && facing_agrees(wi.z, dot(light.wi, front)) && max_component(f.f * light.radiance) > 0.0;
#endif
#if HAS_SPHERE_LIGHTS && !HAS_EMISSION_BOTH
            wanted = wanted && light.id != n.id; // rounding may put a point on a ball's inside outside of it
#endif
            float weight = 1.0;
#if ESTIMATOR == ESTIMATOR_MIS
            if (light.extended) weight = arriving_weight(light.pdf, share * f.pdf);
#endif
            if (wanted) {
                vec3 c = throughput * (f.f * light.radiance * (weight / light.pdf));
#if HAS_TRANSMISSION
#if HAS_NORMAL_MAPS
                c *= facing_dense(dense, side, s, light.t);
#else
                c *= facing_dense(dense, wi.z, s, light.t);
#endif
#endif
#if HAS_ATTENUATION
                bool crosses = (dot(at.ng, light.wi) < 0.0) != inside;
                c *= exp(-(crosses ? beyond.rate : medium.rate) * light.t);
#endif
                uvec2 skip = uvec2(flat_id, light.id);
#if HAS_OPACITY
                c *= passing_share(shapes_leave(at, light.wi), light.wi, light.t, skip);
                bool hidden = false;
#else
                bool hidden = shapes_occluded(shapes_leave(at, light.wi), light.wi, light.t, skip);
#endif
                if (!hidden) result.color += path_clamp(c, bounce > 0u) * share;
            }
#if (HAS_ENVIRONMENT_IMAGE || HAS_ENVIRONMENT_CUBE) && (ESTIMATOR == ESTIMATOR_MIS || ESTIMATOR == ESTIMATOR_LIGHT)
            } while (turn++ < twice);
#endif
#endif
#if ESTIMATOR == ESTIMATOR_UNIFORM
#if HAS_PRINCIPLED
            Sampled picked = bsdf_pick_uniform(s, wo, choice.y, sobol_pair(rng, pair + PAIR_BSDF));
            vec3 wi_next = picked.wi;
            Scatter next = picked.there;
#else
            vec3 wi_next = sampling_hemisphere(sobol_pair(rng, pair + PAIR_BSDF));
            Scatter next = bsdf_eval(s, wo, wi_next);
            next.pdf = 0.5 * INV_PI;
#endif
#elif HAS_PRINCIPLED
            Sampled picked = bsdf_pick(s, wo, choice.y, sobol_pair(rng, pair + PAIR_BSDF));
            vec3 wi_next = picked.wi;
#if HAS_NORMAL_MAPS
            Scatter next = picked.there;
#else
            Scatter next = bsdf_eval(s, wo, wi_next);
            if (picked.specular) next = picked.there;
#endif
#else
            vec3 wi_next = bsdf_sample(s, wo, choice.y, sobol_pair(rng, pair + PAIR_BSDF));
#if HAS_NORMAL_MAPS
            Scatter next = Scatter(vec3(0.0), 0.0);
#else
            Scatter next = bsdf_eval(s, wo, wi_next);
#endif
#endif
            d = frame_to_world(basis, wi_next);
#if HAS_NORMAL_MAPS
#if HAS_PRINCIPLED
            bool certain = picked.specular;
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
            if (mapped && !certain) d = frame_to_world(frame_basis(front), wi_next);
#endif
            float across = dot(d, front);
            if (mapped && across * lobe < 0.0) d -= 2.0 * across * front;
            Scatter folded = facing_folded(s, basis, wo, d, front, mapped);
#if ESTIMATOR == ESTIMATOR_UNIFORM
            if (!certain) next.f = folded.f;
#else
            if (!certain) next = folded;
#endif
            float side_next = mapped ? dot(d, front) : wi_next.z;
            alive = next.pdf > 0.0 && (mapped ? goes : facing_agrees(wi_next.z, dot(d, front)));
#else
            alive = next.pdf > 0.0 && facing_agrees(wi_next.z, dot(d, front));
#endif
            throughput *= next.f / (alive ? next.pdf : 1.0);
            float reach = max_component(throughput);
            alive = alive && reach > 0.0;
            if (alive && !(reach < 1e6)) {
                atomicAdd(path_ended, 1u);
                alive = false;
            }
            bounce++;
            if (bounce >= frame.roulette_depth && bounce < frame.max_bounces) {
                float survive = min(1.0, reach / PATH_WORTH);
                if (sobol_pair(rng, pair + PAIR_ROULETTE).x >= survive) alive = false;
                throughput /= survive > 0.0 ? survive : 1.0;
            }
            o = shapes_leave(at, d);
            n.id = NONE;
#if HAS_TRANSMISSION
#if HAS_NORMAL_MAPS
            dense = facing_dense(dense, side_next, s, 0.0);
#else
            dense = facing_dense(dense, wi_next.z, s, 0.0);
#endif
#endif
#if HAS_ATTENUATION
            if ((dot(at.ng, d) < 0.0) != inside) medium = beyond;
#endif
#if HAS_OPACITY
            if (alive) n = passing_nearest(o, d, flat_id, bounce, rng, at);
#else
            if (alive) n = shapes_nearest(o, d, flat_id);
            at = shapes_point(n, o, d);
#endif
            bool met = n.id != NONE;
#if HAS_ATTENUATION
            throughput *= medium_share(medium, n.t);
#endif
#if ESTIMATOR != ESTIMATOR_LIGHT || HAS_PRINCIPLED
            float found_pdf = share * next.pdf;
#if HAS_PRINCIPLED
            if (picked.specular) found_pdf = PATH_CERTAIN;
#endif
#if ESTIMATOR == ESTIMATOR_LIGHT
            bool counts = picked.specular;
#else
            bool counts = true;
#endif
#if HAS_ENVIRONMENT || HAS_SUN_DISKS
            left = alive && !met && counts;
            left_pdf = found_pdf;
#endif
#if HAS_EMISSION
            vec3 arriving = arriving_emission(at, d);
#if ESTIMATOR == ESTIMATOR_MIS
            if (at.light != NONE) arriving *= arriving_weight(found_pdf, lights_pdf(at.light, n, at, asker, d));
#endif
#if HAS_TRANSMISSION
            arriving *= dense;
#endif
            if (alive && met && counts) result.color += path_clamp(throughput * arriving, bounce > 1u);
#endif
#endif
#if HAS_AMBIENT
            vec3 ambient = arriving_ambient(at);
#if HAS_TRANSMISSION
            ambient *= dense;
#endif
            if (alive && met) result.color += path_clamp(throughput * ambient, bounce > 1u);
#endif
            alive = alive && met;
        } while (alive && bounce < frame.max_bounces);
    }
#if HAS_ENVIRONMENT || HAS_SUN_DISKS
    vec3 arriving = arriving_outside(d, left_pdf, bounce > 0u);
#if HAS_TRANSMISSION
    arriving *= max(dense, 1.0);
#endif
    if (left) result.color += path_clamp(throughput * arriving, bounce > 1u);
#endif
    // llvmpipe ends every loop of an invocation after 65 535 turns in all, without a word.
    path_was_cut = alive && bounce < frame.max_bounces;
    if (path_was_cut) result.color = before; // what the last bounce has met may not be there
    return result;
}
