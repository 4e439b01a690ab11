// Tables of colours: that of a display's view, over linear Rec.709, and one from display values to display values.
#if VIEW_TABLE || LUT_AXES
layout(std430, binding = SLOT_TABLES) readonly buffer table_buffer { vec4 table_texels[]; };

// The table's value at x in [0, 1], from the four corners of the tetrahedron that x lies in [Kasson et al. 1995]: unlike
// interpolation along three axes it keeps greys grey, as the diagonal is an edge of all six.
vec3 tables_tetrahedral(uint first, uint side, vec3 x) {
    vec3 at = x * float(side - 1u);
    uvec3 low = min(uvec3(at), uvec3(side - 2u));
    vec3 f = at - vec3(low);
    uvec3 stride = uvec3(1u, side, side * side);
    uint base = first + low.x + low.y * stride.y + low.z * stride.z;
    uint all = stride.x + stride.y + stride.z;
    float most = max(max(f.x, f.y), f.z), least = min(min(f.x, f.y), f.z);
    float middle = max(min(f.x, f.y), min(max(f.x, f.y), f.z));
    uint along = f.x >= f.y ? (f.x >= f.z ? stride.x : stride.z) : (f.y >= f.z ? stride.y : stride.z);
    uint last = f.x < f.y ? (f.x < f.z ? stride.x : stride.z) : (f.y < f.z ? stride.y : stride.z);
    return table_texels[base].rgb * (1.0 - most) + table_texels[base + along].rgb * (most - middle)
         + table_texels[base + all - last].rgb * (middle - least) + table_texels[base + all].rgb * least;
}
#endif

#if VIEW_TABLE
uniform uint view_side; // nodes of an axis
uniform float view_toe, view_top; // linear values

vec3 tables_view(vec3 c) {
    vec3 x = log2(clamp(c, vec3(0.0), vec3(view_top)) / view_toe + 1.0) / log2(view_top / view_toe + 1.0);
    return tables_tetrahedral(0u, view_side, clamp(x, 0.0, 1.0));
}
#endif

#if LUT_AXES
uniform uint lut_first, lut_side; // where its texels begin, and how many lie along an axis
uniform vec3 lut_low, lut_scale; // of its domain: where it begins, and the reciprocal of its length
#endif

#if LUT_AXES == 3
vec3 tables_lut(vec3 c) { return tables_tetrahedral(lut_first, lut_side, clamp((c - lut_low) * lut_scale, 0.0, 1.0)); }
#elif LUT_AXES == 1
vec3 tables_lut(vec3 c) {
    vec3 at = clamp((c - lut_low) * lut_scale, 0.0, 1.0) * float(lut_side - 1u);
    uvec3 low = lut_first + min(uvec3(at), uvec3(lut_side - 2u)), high = low + 1u;
    vec3 begin = vec3(table_texels[low.x].r, table_texels[low.y].g, table_texels[low.z].b);
    vec3 end = vec3(table_texels[high.x].r, table_texels[high.y].g, table_texels[high.z].b);
    return mix(begin, end, at - vec3(low - lut_first));
}
#endif
