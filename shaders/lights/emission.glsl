// Rays of light that leave the lights, for path/light_path.glsl. A light is picked by its power, a place on it by its
// area. The ray is aimed at the targets: balls around the shapes that mirror or refract perfectly (gpu/picture/caustics.py).
// Which target is aimed at is forgotten: the density of a ray is that of the mixture over all of them.

#if CAUSTICS
struct Target {
    vec3 center;
    float radius;
};

// Words of gpu/picture/caustics.py: counts; the targets; the light's index, its chance, and the sum of the chances up to
// it, of each light.
layout(std430, binding = SLOT_LIGHT_SOURCES) readonly buffer light_source_buffer { uvec4 light_source_words[]; };

uint emission_target_count() { return light_source_words[0].x; }

Target emission_target(uint i) {
    vec4 w = uintBitsToFloat(light_source_words[1u + i]);
    return Target(w.xyz, w.w);
}

// Picks a light; its `probability` is that of this choice.
Light emission_pick(float u) {
    uint first = 1u + emission_target_count(), low = 0u, high = light_source_words[0].y - 1u;
    while (low < high) {
        uint middle = (low + high) / 2u;
        if (u < uintBitsToFloat(light_source_words[first + middle].z)) high = middle;
        else low = middle + 1u;
    }
    uvec4 word = light_source_words[first + low];
    Light l = light_load(word.x);
    l.probability = uintBitsToFloat(word.y);
    return l;
}

struct Emission {
    SurfacePoint at; // where the ray begins, on a shape
    vec3 o;
    vec3 d;
    vec3 flux; // radiant flux over the density of this ray, W
    uint skip; // the shape that the ray cannot meet
    bool placed; // it begins at a place, and not at infinity
};

// 1 - cos of the half angle of the cone that a target fills, as seen from p; 2 from inside.
float emission_cap(Target t, vec3 p) {
    vec3 to = t.center - p;
    float sin2 = t.radius * t.radius / dot(to, to);
    return sin2 < 1.0 ? sin2 / (1.0 + sqrt(1.0 - sin2)) : 2.0;
}

// The weight of a target that fills this cap: that of its square root, so that a small one gets its share beside a large
// one.
float emission_weight(float cap) { return sqrt(cap); }

// A direction from p towards the targets, and its density per solid angle.
vec3 emission_aim(vec3 p, float u_target, vec2 u, out float pdf) {
    uint count = emission_target_count(), i = 0u, k = 0u;
    float total = 0.0;
    for (i = 0u; i < count; i++) total += emission_weight(emission_cap(emission_target(i), p));
    float rest = u_target * total;
    for (i = 0u; i < count; i++) {
        float weight = emission_weight(emission_cap(emission_target(i), p));
        if (rest >= 0.0) k = i;
        rest -= weight;
    }
    Target chosen = emission_target(k);
    vec3 to = chosen.center - p;
    float far2 = dot(to, to);
    vec3 axis = far2 > 0.0 ? to * inversesqrt(far2) : vec3(0.0, 0.0, 1.0);
    vec3 d = basis_to_world(basis_make(axis), sampling_cone(emission_cap(chosen, p), u));
    pdf = 0.0;
    for (i = 0u; i < count; i++) {
        Target other = emission_target(i);
        float cap = emission_cap(other, p);
        vec3 off = d - normalize(other.center - p);
        if (i == k || cap == 2.0 || 0.5 * dot(off, off) < cap) pdf += emission_weight(cap) / (TWO_PI * cap);
    }
    pdf /= total;
    return d;
}

// A ray along d, which comes from infinity, through a disk across d around a target; its density per area.
vec3 emission_aim_parallel(vec3 d, float u_target, vec2 u, out float pdf) {
    uint count = emission_target_count(), i = 0u, k = 0u;
    float total = 0.0;
    for (i = 0u; i < count; i++) total += emission_target(i).radius;
    float rest = u_target * total;
    for (i = 0u; i < count; i++) {
        if (rest >= 0.0) k = i;
        rest -= emission_target(i).radius;
    }
    Target chosen = emission_target(k);
    Basis across = basis_make(d);
    vec2 place = chosen.radius * sampling_disk(u);
    vec3 o = chosen.center + place.x * across.x + place.y * across.y;
    pdf = 0.0;
    for (i = 0u; i < count; i++) {
        Target other = emission_target(i);
        vec3 off = o - other.center;
        off -= dot(off, d) * d;
        if (i == k || dot(off, off) < other.radius * other.radius) pdf += 1.0 / (PI * other.radius);
    }
    pdf /= total;
    return o - d * (uintBitsToFloat(light_source_words[0].z) + dot(o - emission_target(0u).center, d));
}

#if HAS_DIRECTIONAL_LIGHTS || HAS_SUN
// Light of this irradiance, on a surface that faces it, along d.
void emission_from_infinity(vec3 d, vec3 irradiance, float u_target, vec2 u, inout Emission e) {
    float pdf;
    e.d = d;
    e.o = emission_aim_parallel(d, u_target, u, pdf);
    e.flux = irradiance / pdf;
}
#endif

void emission_directional_case(Light l, float u_target, vec2 u_sun, vec2 u, inout Emission e) {
#if HAS_DIRECTIONAL_LIGHTS
    if (l.kind == LIGHT_DIRECTIONAL) {
        vec3 irradiance = l.intensity;
        vec3 to_light = -l.direction;
#if HAS_SUN_DISKS
        if (l.spread > 0.0) {
            to_light = basis_to_world(basis_make(to_light), sampling_cone(l.spread, u_sun));
            irradiance *= TWO_PI * l.spread;
        }
#endif
        emission_from_infinity(-to_light, irradiance, u_target, u, e);
    }
#endif
}

// The sun of the environment, whose other light is not traced from here.
void emission_sun_case(Light l, float u_target, vec2 u_sun, vec2 u, inout Emission e) {
#if HAS_SUN
    if (l.kind == LIGHT_ENVIRONMENT) {
        vec3 to_sun = sun_sample(u_sun);
        vec3 radiance = uniforms.environment_sun_radiance * uniforms.environment_scale;
        vec3 irradiance = radiance * (TWO_PI * uniforms.environment_sun_cap);
        if (to_sun.y <= 0.0) irradiance = vec3(0.0); // behind the ground
        emission_from_infinity(-environment_turn_back(to_sun), irradiance, u_target, u, e);
    }
#endif
}

void emission_point_case(Light l, float u_target, vec2 u, inout Emission e) {
#if ANY_POINT_LIGHTS
    if (LIGHT_IS_POINT(l.kind)) {
        float pdf;
        e.d = emission_aim(l.position, u_target, u, pdf);
        e.o = l.position;
        e.placed = true;
        e.flux = l.intensity / pdf;
        e.flux *= lights_share(l, -e.d);
    }
#endif
}

void emission_shape_case(Light l, float u_target, vec2 u_place, vec2 u, inout Emission e) {
#if HAS_EMISSION
    if (l.kind >= LIGHT_SPHERE) {
        float pdf;
        LightPlace place = lights_place(l, u_place);
        e.at = shapes_point(Hit(0.0, place.id, place.uv), place.p, vec3(0.0, 0.0, 1.0));
        e.d = emission_aim(e.at.p, u_target, u, pdf);
        vec3 radiance = found_light_emission(e.at, -e.d, cone_none());
        float across = dot(e.d, e.at.ng);
#if HAS_OPACITY
        radiance *= transparency_opacity(e.at, false);
#endif
#if HAS_SINGLE_SIDED
        if (across < 0.0 && (e.at.shape & SINGLE_SIDED) != 0u) radiance = vec3(0.0);
#endif
        e.o = shapes_leave(e.at, e.d);
        e.skip = e.at.flat_id;
        e.placed = true;
        e.flux = radiance * (abs(across) / (pdf * place.pdf_area));
    }
#endif
}

// A ray of light towards a target. Of the functions above only the one of the light's kind changes it.
Emission emission_sample(Sampler rng) {
    vec2 choice = sobol_pair(rng, PAIR_PIXEL), u_place = sobol_pair(rng, sobol_bounce_pair(0u) + PAIR_LIGHT);
    vec2 u = sobol_pair(rng, sobol_bounce_pair(0u) + PAIR_BSDF);
    Light l = emission_pick(choice.x);
    Emission e = Emission(shapes_none(vec3(0.0), vec3(0.0, 0.0, 1.0)), vec3(0.0), vec3(0.0, 0.0, 1.0), vec3(0.0), NONE,
                          false);
    emission_point_case(l, choice.y, u, e);
    emission_directional_case(l, choice.y, u_place, u, e);
    emission_sun_case(l, choice.y, u_place, u, e);
    emission_shape_case(l, choice.y, u_place, u, e);
    e.flux /= l.probability;
    return e;
}
#endif
