// The sun of the sky: a disk of even radiance in the environment's space. It is picked with a share of its own and
// sampled uniformly over its cone. The part below the horizon is behind the ground.

#if HAS_SUN
// 1 - cos is taken from the difference of the directions, as cos itself is 0.5 % off for a disk this small.
bool sun_holds(vec3 d) {
    vec3 off = d - uniforms.environment_sun;
    return dot(off, off) < 2.0 * uniforms.environment_sun_cap;
}

vec3 sun_sample(vec2 u) {
    return basis_to_world(basis_make(uniforms.environment_sun), sampling_cone(uniforms.environment_sun_cap, u));
}

// The first of the two random numbers, stretched to all 32 bits again where the sun was not picked.
uint sun_rest(uint bits, uint cut) {
    uint x = bits - cut;
    float stretch = uniforms.environment_sun_share / (1.0 - uniforms.environment_sun_share);
    return x + uint(float(x) * stretch);
}
#endif
