// Reflection by half and difference angles, between the middles of the table's cells [Rusinkiewicz 1998; Matusik et al.
// 2003]. service/formats/read/measured/merl.py does the same.
#if HAS_MEASURED_ANGLES
vec3 half_difference_eval(Measured m, vec3 wo, vec3 wi) {
    vec3 sum = wo + wi;
    float across = length(sum.xy);
    vec2 along = across > 1e-9 ? sum.xy / across : vec2(1.0, 0.0);
    vec2 tilt = vec2(across, sum.z) / length(sum); // sine and cosine
    float x = tilt.y * dot(along, wi.xy) - tilt.x * wi.z, y = along.x * wi.y - along.y * wi.x;
    vec2 angles = vec2(atan(across, sum.z), atan(length(wi - wo), length(sum))) * (2.0 * INV_PI);
    vec2 shape = vec2(MEASURED_SHAPE.xy);
    uint h, d;
    float s = measured_split(shape.x * sqrt(angles.x) - 0.5, MEASURED_SHAPE.x, h);
    float t = measured_split(shape.y * angles.y - 0.5, MEASURED_SHAPE.y, d);
    float turn = atan(y, x) * INV_PI, count = float(MEASURED_SHAPE.z);
    float place = (turn - floor(turn)) * count + (count - 0.5);
    uint p = uint(place);
    float u = place - float(p);
    p = p % MEASURED_SHAPE.z;
    vec3 total = vec3(0.0);
    for (uint k = 0u; k < 4u; k++) {
        uvec2 corner = uvec2(h, d) + uvec2(k & 1u, k >> 1u);
        vec3 a, b;
        measured_pair(m.values + (corner.x * MEASURED_SHAPE.y + corner.y) * MEASURED_SHAPE.z + p, a, b);
        total += ((k & 1u) == 1u ? s : 1.0 - s) * ((k >> 1u) == 1u ? t : 1.0 - t) * mix(a, b, u);
    }
    return total * m.scale;
}
#endif
