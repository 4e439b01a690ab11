// Reflection over an adaptive parameterization [Dupuy & Jakob 2018, eq. 8 and section 4]: the values are by the numbers
// that the density of visible facets takes to the normal between the two directions.
#if HAS_MEASURED_ADAPTIVE
// A table of one number a node.
float adaptive_table(uint first, uint size, vec2 at) {
    uvec2 sides = measured_size(size);
    uint column, row;
    float s = measured_split(at.x * float(sides.x - 1u), sides.x, column);
    float t = measured_split(at.y * float(sides.y - 1u), sides.y, row);
    uint place = first + row * sides.x + column;
    vec4 a = measured_texel(place), b = measured_texel(place + 1u); // of this row and of the next
    return mix(mix(a.x, b.x, s), mix(a.y, b.y, s), t);
}

vec3 adaptive_color(Measured m, uint slice, uvec2 sides, uint row, uint column, vec2 part) {
    vec3 a, b, c, d;
    uint place = m.values + (slice * sides.y + row) * sides.x + column;
    measured_pair(place, a, b);
    measured_pair(place + sides.x, c, d);
    return mix(mix(a, b, part.x), mix(c, d, part.x), part.y);
}

vec3 adaptive_colors(Measured m, MeasuredSlices slices, vec2 at) {
    uvec2 sides = measured_size(m.values_size);
    uint column, row;
    vec2 part;
    part.x = measured_split(at.x * float(sides.x - 1u), sides.x, column);
    part.y = measured_split(at.y * float(sides.y - 1u), sides.y, row);
    vec3 sum = slices.weight.x * adaptive_color(m, slices.index.x, sides, row, column, part);
    if (slices.weight.y > 0.0) sum += slices.weight.y * adaptive_color(m, slices.index.y, sides, row, column, part);
#if HAS_ANISOTROPIC
    if (slices.weight.z > 0.0) sum += slices.weight.z * adaptive_color(m, slices.index.z, sides, row, column, part);
    if (slices.weight.w > 0.0) sum += slices.weight.w * adaptive_color(m, slices.index.w, sides, row, column, part);
#endif
    return sum;
}

// Reflection times the cosine of wi at the numbers `drawn`, which lead to the facets `at`.
vec3 adaptive_value(Measured m, MeasuredSlices slices, vec3 wo, vec2 at, vec2 drawn) {
    vec3 value = adaptive_colors(m, slices, drawn) * m.scale;
    if (m.areas != 0u) {
        value *= adaptive_table(m.facets, m.facets_size, at)
               / (4.0 * max(adaptive_table(m.areas, m.areas_size, measured_square(wo, 0.0)), 1e-9));
    }
    return value;
}
#endif
