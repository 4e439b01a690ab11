// Angles of directions, and the factors that keep a measurement from reflecting more than arrives.
#if HAS_MEASURED
float measured_theta(vec3 w) { return atan(length(w.xy), w.z); }

// Two neighbouring colours.
void measured_pair(uint i, out vec3 a, out vec3 b) {
    uvec3 w = measured_words(i).xyz;
    vec2 x = unpackHalf2x16(w.x), y = unpackHalf2x16(w.y), z = unpackHalf2x16(w.z);
    a = vec3(x, y.x);
    b = vec3(y.y, z);
}

// Splits a place among n nodes into the first of two neighbours and the way to the second.
float measured_split(float place, uint n, out uint first) {
    first = min(uint(max(place, 0.0)), n - 2u);
    return clamp(place - float(first), 0.0, 1.0);
}

#if HAS_MEASURED_LIMITS
vec3 measured_limit(Measured m, vec3 w) {
    uint k;
    float t = measured_split(measured_theta(w) * (2.0 * INV_PI) * float(MEASURED_LIMIT_ANGLES - 1u),
                             MEASURED_LIMIT_ANGLES, k);
    return m.limits == 0u ? vec3(1.0) : mix(measured_texel(m.limits + k).xyz, measured_texel(m.limits + k + 1u).xyz, t);
}
#endif
#endif
