// Light from infinity: parallel, or uniform over a disk of directions of half angle a with radiance E / (pi sin^2 a),
// whose irradiance on a surface that faces the disk's middle is E.
float directional_light_pdf(Light l) { return 1.0 / (TWO_PI * l.spread); }

// The radiance from direction wi, which must be unit. Half the square of a difference is 1 - cos without cancelling.
vec3 directional_light_radiance(Light l, vec3 wi) {
    vec3 off = wi + l.direction;
    return 0.5 * dot(off, off) <= l.spread ? l.intensity : vec3(0.0);
}

LightSample directional_light_sample(Light l, vec2 u) {
    vec3 wi = -l.direction;
#if HAS_SUN_DISKS
    if (l.spread > 0.0) {
        wi = basis_to_world(basis_make(wi), sampling_cone(l.spread, u));
        return LightSample(wi, INFINITY_T, l.intensity, directional_light_pdf(l), true, NONE);
    }
#endif
    return LightSample(wi, INFINITY_T, l.intensity, 1.0, false, NONE);
}

void directional_light_sample_case(Light l, vec2 u, inout LightSample s) {
#if HAS_DIRECTIONAL_LIGHTS
    if (l.kind == LIGHT_DIRECTIONAL) s = directional_light_sample(l, u);
#endif
}
