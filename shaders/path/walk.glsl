// Walks under a surface: light that enters there is scattered by an index-matched medium and comes out elsewhere, evenly in
// all directions, as far as the surface lets it out. A walk stays in its shape and passes all others. It counts as one
// event, and ends after WALK_STEPS steps, which is a bias: docs/price.md has it.

#include "path/half_space.glsl"

#if HAS_WALKS
const uint WALK_STEPS = 256u;

// Whether the path is under a surface.
bool walk_goes_on(Path path) { return path.walks; }

// How many walks the path has begun.
uint walk_count(Path path) { return path.walked; }

// Whether the walk may take another step.
bool walk_lasts(Path path) { return path.steps < WALK_STEPS; }

// Whether the surface that the walk has come to is its own, from below.
bool walk_leaves(Path path) { return path.at.shape == path.walk_shape && dot(path.at.ng, path.d) > 0.0; }

// A random number of this step, apart from those of whole paths.
float walk_random(Sampler rng, Path path, uint which) {
    uint bits = sobol_bits(rng, sobol_bounce_pair(path.bounce) + PAIR_ROULETTE).y;
    bits = sobol_hash(bits ^ (4u * path.steps + which) * 0x9e3779b9u);
    return float(bits >> 8u) / 16777216.0;
}

// The medium under the surface, of which a half space shows the material's colour.
Medium walk_medium(Material m, float least) {
    Medium r = medium_none();
    r.depth = 1.0;
    r.rate = 1.0 / max(m.subsurface_radius, vec3(least));
    r.scattering = r.rate * half_space_albedo(clamp(model_walk_color(m), 0.0, 1.0), m.subsurface_g);
    r.forward = m.subsurface_g * dot(r.scattering, vec3(1.0 / 3.0));
    return r;
}

// Forgets the walk before this one, where none is under way: it takes no registers then.
void walk_none(inout Path path) {
    path.walks = false;
    path.steps = path.walk_shape = 0u;
    path.outside = path.medium;
}

// Begins a path, which has not walked.
void walk_begin(inout Path path) {
    walk_none(path);
    path.walked = 0u;
}

// Takes the path under the surface where it is.
void walk_enter(Material m, inout Path path) {
    path.walks = true;
    path.walked++;
    path.steps = 0u;
    path.walk_shape = path.at.shape;
#if HAS_SMOOTH_NORMALS
    path.at.lift = vec3(0.0); // what goes under the surface begins at it
#endif
    path.outside = path.medium;
    path.medium = walk_medium(m, 4.0 * dot(abs(path.at.ng), path.at.error)); // else the ray would begin deep within
}

// Counts the walk's steps, and ends it where it comes out.
void walk_arrive(inout Path path) {
    path.steps++;
    if (event_is_exit(path.event)) {
        path.walks = false;
        path.medium = path.outside;
    }
    if (!path.walks) path.steps = 0u;
}

// Turns the walk at a particle.
void walk_turn(Sampler rng, inout Path path) {
    float g = path.medium.forward / max(dot(path.medium.scattering, vec3(1.0 / 3.0)), 1e-30);
    vec3 w = phase_sample(g, vec2(walk_random(rng, path, 1u), walk_random(rng, path, 2u)));
    path.d = basis_to_world(basis_make(-path.d), w);
    path.o = path.at.p;
}

// Describes the place where light comes out, as seen from outside.
void walk_interaction(Path path, inout Interaction here) {
    if (event_is_exit(path.event)) {
        here.front = here.fold = here.facing = path.at.ng;
        here.basis = basis_make(path.at.ns);
        here.wo = vec3(0.0, 0.0, 1.0);
        here.behind = here.mapped = here.transmits = false;
        here.beyond = path.medium;
    }
}
#else
bool walk_goes_on(Path path) { return false; }
uint walk_count(Path path) { return 0u; }
bool walk_lasts(Path path) { return false; }
bool walk_leaves(Path path) { return false; }
float walk_random(Sampler rng, Path path, uint which) { return 0.0; }
void walk_none(inout Path path) {}
void walk_begin(inout Path path) {}
void walk_enter(Material m, inout Path path) {}
void walk_arrive(inout Path path) {}
void walk_turn(Sampler rng, inout Path path) {}
void walk_interaction(Path path, inout Interaction here) {}
#endif
