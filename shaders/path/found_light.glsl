// Light that a path finds by chance: emission and ambient light of surfaces, and light from infinity.

#if HAS_SUN_DISKS
// Radiance along d from the disks of directional lights, each weighted against sampling it directly. `pdf` is the
// density of d.
vec3 found_light_disks(vec3 d, float pdf) {
    vec3 sum = vec3(0.0);
    uint i = 0u;
    do {
        Light l = light_load(uniforms.sun_first + i);
        vec3 c = directional_light_radiance(l, d);
        if (ESTIMATOR == ESTIMATOR_MIS) c *= power_heuristic(pdf, directional_light_pdf(l) * l.probability);
        if (i < uniforms.sun_count) sum += c; // a kernel with every flag raised may have no disk
    } while (++i < uniforms.sun_count);
    return sum;
}
#endif

// Whether the camera sees the environment where it sees no surface.
bool found_light_background() {
#if HAS_ENVIRONMENT
    return uniforms.environment_background != 0u;
#else
    return false;
#endif
}

// Radiance from infinity along d, weighted against sampling it directly; `pdf` is the density of d. The camera does not
// see the disks of directional lights: they count where the path was `scattered`.
vec3 found_light_outside(vec3 d, float pdf, bool scattered, bool sunless) {
    vec3 arriving = vec3(0.0);
#if HAS_ENVIRONMENT
    vec4 l = environment_radiance(d, !sunless);
    arriving = l.rgb;
    if (ESTIMATOR == ESTIMATOR_MIS) arriving *= power_heuristic(pdf, l.a * uniforms.environment_probability);
#endif
#if HAS_SUN_DISKS
    if (scattered && !sunless) arriving += found_light_disks(d, pdf);
#endif
    return arriving;
}

// Emission, without the layers on it, towards the side that a ray along d came from: the outward side, unless both sides of the material shine.
vec3 found_light_bare(SurfacePoint at, vec3 d, Cone cone) {
#if HAS_TEXTURED_LIGHTS && HAS_EMISSION_BOTH
    bool both = material_pick(at.material).emission_sides == 2u;
    if (at.light != NONE && (dot(d, at.ng) < 0.0 || both)) return texture_emission(at, cone_footprint(cone, at, d));
#elif HAS_TEXTURED_LIGHTS
    if (at.light != NONE && dot(d, at.ng) < 0.0) return texture_emission(at, cone_footprint(cone, at, d));
#elif HAS_EMISSION_BOTH
    Material m = material_pick(at.material);
    if (at.light != NONE && (dot(d, at.ng) < 0.0 || m.emission_sides == 2u)) return m.emission;
#elif HAS_EMISSION
    if (at.light != NONE && dot(d, at.ng) < 0.0) return material_pick(at.material).emission;
#endif
    return vec3(0.0);
}

// Emission as it leaves the surface, likewise.
vec3 found_light_emission(SurfacePoint at, vec3 d, Cone cone) {
    vec3 emission = found_light_bare(at, d, cone);
#if HAS_LAYERED_LIGHTS
    emission *= light_layers(at, -d);
#endif
    return emission;
}

// Ambient radiance, a constant that some models add: both sides send it, and it is never sampled as a light.
vec3 found_light_ambient(SurfacePoint at, vec3 d, Cone cone) {
#if HAS_AMBIENT && HAS_TEXTURES
    return texture_ambient(at, cone_footprint(cone, at, d));
#elif HAS_AMBIENT
    return material_pick(at.material).ambient;
#else
    return vec3(0.0);
#endif
}
