// Densities over the unit square, one for each of the viewer's directions, bilinear between their nodes; between the
// viewer's directions, densities and their integrals are interpolated linearly [Dupuy & Jakob 2018, supplement].
// gpu/layout/measured_records.py has the texels; service/formats/read/measured/warp.py the same for single densities.
#if HAS_MEASURED

// The tables of up to four neighbouring directions of the viewer, and their weights.
struct MeasuredSlices {
    uvec4 index;
    vec4 weight;
};

// The angle's place among n growing ones, a texel each: the first of two neighbours, and the way to the second.
float measured_find(uint angles, uint n, float angle, out uint first) {
    uint low = 0u, high = max(n, 2u) - 1u;
    while (high - low > 1u) {
        uint middle = (low + high) / 2u;
        if (measured_texel(angles + middle).x <= angle) low = middle;
        else high = middle;
    }
    first = low;
    float a = measured_texel(angles + low).x, b = measured_texel(angles + low + 1u).x;
    return n < 2u ? 0.0 : clamp((angle - a) / (b - a), 0.0, 1.0);
}

// `azimuth` is that of wo.
MeasuredSlices measured_slices(Measured m, vec3 wo, float azimuth) {
    uint theta, phi = 0u;
    float s = measured_find(m.angles, m.thetas, measured_theta(wo), theta), t = 0.0;
#if HAS_ANISOTROPIC
    t = measured_find(m.angles + m.thetas, m.phis, azimuth, phi);
#endif
    uint here = phi * m.thetas + theta;
    uvec2 next = uvec2(s > 0.0 ? 1u : 0u, t > 0.0 ? m.thetas : 0u);
    return MeasuredSlices(here + uvec4(0u, next.x, next.y, next.x + next.y),
                          vec4((1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t));
}

struct MeasuredWarp {
    uint first;
    uvec2 size; // columns and rows
};

MeasuredWarp measured_warp(uint first, uint size) { return MeasuredWarp(first, measured_size(size)); }

// A texel of the tables of all these directions together.
vec4 measured_mixed(MeasuredSlices slices, uint first, uint stride, uint at) {
    vec4 sum = slices.weight.x * measured_texel(first + slices.index.x * stride + at);
    if (slices.weight.y > 0.0) sum += slices.weight.y * measured_texel(first + slices.index.y * stride + at);
#if HAS_ANISOTROPIC
    if (slices.weight.z > 0.0) sum += slices.weight.z * measured_texel(first + slices.index.z * stride + at);
    if (slices.weight.w > 0.0) sum += slices.weight.w * measured_texel(first + slices.index.w * stride + at);
#endif
    return sum;
}

vec4 measured_row(MeasuredWarp warp, MeasuredSlices slices, uint row) {
    return measured_mixed(slices, warp.first, warp.size.y * (1u + warp.size.x), row);
}

vec4 measured_node(MeasuredWarp warp, MeasuredSlices slices, uint row, uint column) {
    return measured_mixed(slices, warp.first, warp.size.y * (1u + warp.size.x),
                          warp.size.y + row * warp.size.x + column);
}

// How far from 0 to 1 the integral of a density, which runs straight from a to b, comes to `area`.
float measured_part(float a, float b, float area) {
    float root = a + sqrt(max(a * a + 2.0 * area * (b - a), 0.0));
    return clamp(root > 0.0 ? 2.0 * area / root : 0.0, 0.0, 1.0);
}

float measured_density(MeasuredWarp warp, MeasuredSlices slices, vec2 at) {
    uint column, row;
    float s = measured_split(at.x * float(warp.size.x - 1u), warp.size.x, column);
    float t = measured_split(at.y * float(warp.size.y - 1u), warp.size.y, row);
    vec2 a = measured_node(warp, slices, row, column).xy, b = measured_node(warp, slices, row, column + 1u).xy;
    return mix(mix(a.x, a.y, t), mix(b.x, b.y, t), s);
}

// The place that uniform numbers are taken to.
vec2 measured_draw(MeasuredWarp warp, MeasuredSlices slices, vec2 u, out float density) {
    uint low = 0u, high = warp.size.y - 1u;
    while (high - low > 1u) {
        uint middle = (low + high) / 2u;
        if (measured_row(warp, slices, middle).x <= u.y) low = middle;
        else high = middle;
    }
    uint row = low;
    vec4 line = measured_row(warp, slices, row);
    float t = measured_part(line.y, line.z, (u.y - line.x) * float(warp.size.y - 1u));
    float rest = u.x * mix(line.y, line.z, t);
    low = 0u;
    high = warp.size.x - 1u;
    while (high - low > 1u) {
        uint middle = (low + high) / 2u;
        vec2 so_far = measured_node(warp, slices, row, middle).zw;
        if (mix(so_far.x, so_far.y, t) <= rest) low = middle;
        else high = middle;
    }
    vec4 a = measured_node(warp, slices, row, low), b = measured_node(warp, slices, row, low + 1u);
    float left = mix(a.x, a.y, t), right = mix(b.x, b.y, t);
    float s = measured_part(left, right, (rest - mix(a.z, a.w, t)) * float(warp.size.x - 1u));
    density = mix(left, right, s);
    return vec2((float(low) + s) / float(warp.size.x - 1u), (float(row) + t) / float(warp.size.y - 1u));
}

// The numbers that are taken to this place.
vec2 measured_undraw(MeasuredWarp warp, MeasuredSlices slices, vec2 at, out float density) {
    uint column, row;
    float s = measured_split(at.x * float(warp.size.x - 1u), warp.size.x, column);
    float t = measured_split(at.y * float(warp.size.y - 1u), warp.size.y, row);
    vec4 a = measured_node(warp, slices, row, column), b = measured_node(warp, slices, row, column + 1u);
    vec4 line = measured_row(warp, slices, row);
    float left = mix(a.x, a.y, t), right = mix(b.x, b.y, t);
    density = mix(left, right, s);
    float across = mix(a.z, a.w, t) + s * (left + 0.5 * s * (right - left)) / float(warp.size.x - 1u);
    float whole = mix(line.y, line.z, t);
    float down = line.x + t * (line.y + 0.5 * t * (line.z - line.y)) / float(warp.size.y - 1u);
    return clamp(vec2(whole > 0.0 ? across / whole : 0.0, down), 0.0, 1.0);
}

// A facet's normal on the unit square, seen from the viewer's azimuth or from that of the surface.
vec2 measured_square(vec3 wm, float azimuth) {
    float turn = (atan(wm.y, wm.x) - azimuth) / TWO_PI + 0.5;
    return vec2(sqrt(measured_theta(wm) * (2.0 * INV_PI)), turn - floor(turn));
}

vec3 measured_normal(vec2 at, float azimuth) {
    float theta = 0.5 * PI * at.x * at.x, phi = (2.0 * at.y - 1.0) * PI + azimuth;
    return vec3(sin(theta) * vec2(cos(phi), sin(phi)), cos(theta));
}

// Steradians of light's direction over the area of the square.
float measured_area(vec2 at, vec3 wm, float cos_d) {
    return max(2.0 * PI * PI * at.x * length(wm.xy), 1e-12) * 4.0 * cos_d;
}
#endif
